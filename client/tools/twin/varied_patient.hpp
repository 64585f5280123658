// SPDX-License-Identifier: GPL-3.0-or-later
// Another patient on the same head: another tumour, the opening over it, and the position of the
// head.
//
//   opening    a place on the brain's surface, uniform by area, among those a craniotomy can
//              reach: above kSkullBase of the brain's height, facing outwards into free space for
//              kFreeWay_mm (no fissure, no sulcus), and kFromMidline_mm or more from the sagittal
//              plane through the middle of the brain (the sinus lies there). Axes as below; the
//              long axis in any direction.
//   tumour     an ellipsoid with half axes from kLeastHalfAxis_mm to kMostHalfAxis_mm, whose
//              centre lies kLeastDepth_mm to kMostDepth_mm along an approach up to kApproach_deg
//              beside the surface's normal. All of its surface lies kMargin_mm or more inside the
//              brain: more than elements of 8 mm cut off a head (0.5 mm) and than sulci that the
//              mesh closes.
//   gravity    opposite to the opening's normal, turned by up to kUppermost_deg in any direction:
//              a surgeon turns the head until the opening is about uppermost, supine, on the side,
//              prone or sitting. Never more than kHeadDown_deg head down.
// A draw that does not fit, or whose node sets anatomy::select_node_sets rejects, is drawn again.
// So small and deep tumours are somewhat more frequent than in the ranges.
//
// The ranges are guesses of what is plausible; the paper's tumour (11 cc) and opening (45 x 24 mm)
// lie inside them.
#pragma once

#include <cstdint>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::client {

inline constexpr double kSkullBase = 0.4;
inline constexpr double kFreeWay_mm = 20.0;
inline constexpr double kFromMidline_mm = 12.0;
inline constexpr double kLeastHalfAxis_mm = 8.0, kMostHalfAxis_mm = 20.0;
inline constexpr double kLeastDepth_mm = 10.0, kMostDepth_mm = 35.0;
inline constexpr double kApproach_deg = 20.0;
inline constexpr double kMargin_mm = 3.0;
inline constexpr double kLeastLongAxis_mm = 40.0, kMostLongAxis_mm = 60.0;
inline constexpr double kLeastShortAxis_mm = 24.0, kMostShortAxis_mm = 40.0;
inline constexpr double kUppermost_deg = 45.0;
inline constexpr double kHeadDown_deg = 15.0;

// brain: a mesh of the head, closed, for instance that of the case as it is. The same seed gives
// the same patient; case_id gets "-SEED" appended. All but tumour, craniotomy and gravity is as in
// the case. kNotConverged: no draw in 1,000 fits. Errors of geometry::ClosestPointIndex.
Result<CaseConfig> vary_patient(const CaseConfig& config, const TetMesh& brain, std::uint64_t seed);

}  // namespace brainshift::client
