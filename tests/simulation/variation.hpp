// SPDX-License-Identifier: GPL-3.0-or-later
// Variations of a scenario: what differs from one surgery of its kind to the next.
//
// All draws are independent and uniform unless stated. The ranges are guesses of what is plausible,
// made before any estimate was scored on them.
//
//   fluid level       +- kFluidLevel_mm: drainage depends on posture and on cisterns that happen to
//                     be opened; at 55 mm of depth that is a quarter of the lost fluid
//   pose              gravity turned by up to kGravityTurn_deg about any axis: a head clamp whose
//                     pose is read by eye. The scenario's own tilt stays.
//   stiffness         ln G with standard deviation kStiffnessSd over kStiffnessLength_mm: grey and
//                     white matter differ by some 30 %, and gyri are about that wide
//   swelling          strength times kMinSwelling to kMaxSwelling: oedema that is resolving to
//                     somewhat more than the scenario's; its sign stays. Its centre moves by up to
//                     kSwellingOffset_mm, uniform in a ball: oedema lies beside the tumour as often
//                     as beneath it.
//   shrinkage         where the scenario allows it (Scenario::largest_shrinkage): a volume strain
//                     from 0 to that, of the whole brain or of the tumour's half with equal
//                     probability
//   retraction        pressure times kMinPress to kMaxPress; it draws aside in any direction at
//                     an angle up to kMaxAside_deg; its middle moves by up to kSpatulaOffset_mm
//   resection         fraction of the tumour's volume from kMinResected to kMaxResected: the
//                     superficial part goes first, and what is left at the ground is being decided
//
// Noise, the points that are measured and the pattern of the stiffness come from the seed of
// play_scenario, which may be the same number.
#pragma once

#include <cstdint>

#include "client/tools/twin/scenario.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/configuration/case_config.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::client {

inline constexpr double kFluidLevel_mm = 15.0;
inline constexpr double kGravityTurn_deg = 6.0;
inline constexpr double kStiffnessSd = 0.3, kStiffnessLength_mm = 20.0;
inline constexpr double kMinSwelling = 0.5, kMaxSwelling = 1.3;
inline constexpr double kSwellingOffset_mm = 15.0;
inline constexpr double kMinPress = 0.5, kMaxPress = 1.3;
inline constexpr double kMaxAside_deg = 60.0, kSpatulaOffset_mm = 8.0;
inline constexpr double kMinResected = 0.6, kMaxResected = 0.8;

// The same seed gives the same variation. It promises no contact-free brain, whatever the scenario
// promised.
Scenario vary(const Scenario& scenario, std::uint64_t seed);

// play_scenario with a forward model that exists already. Precondition: it was built for this model
// and case with the contact boundary. Where the scenario changes the brain (stiffness, resection),
// the truth needs another one.
Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const contact::ForwardModel& forward,
                                       const Scenario& scenario, std::uint64_t seed);

// Another patient on the same head: another tumour, the opening over it, and the position of the
// head.
//
//   opening    a place on the brain's surface, uniform by area, among those a craniotomy can
//              reach: above kSkullBase of the brain's height, facing outwards into free space for
//              kFreeWay_mm (no fissure, no sulcus), and kFromMidline_mm or more from the sagittal
//              plane through the middle of the brain (the sinus lies there). Axes as below; the
//              long axis in any direction.
//   tumour     an ellipsoid with half axes from kMinHalfAxis_mm to kMaxHalfAxis_mm, whose
//              centre lies kMinDepth_mm to kMaxDepth_mm along an approach up to kApproach_deg
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
inline constexpr double kSkullBase = 0.4;
inline constexpr double kFreeWay_mm = 20.0;
inline constexpr double kFromMidline_mm = 12.0;
inline constexpr double kMinHalfAxis_mm = 8.0, kMaxHalfAxis_mm = 20.0;
inline constexpr double kMinDepth_mm = 10.0, kMaxDepth_mm = 35.0;
inline constexpr double kApproach_deg = 20.0;
inline constexpr double kMargin_mm = 3.0;
inline constexpr double kMinLongAxis_mm = 40.0, kMaxLongAxis_mm = 60.0;
inline constexpr double kMinShortAxis_mm = 24.0, kMaxShortAxis_mm = 40.0;
inline constexpr double kUppermost_deg = 45.0;
inline constexpr double kHeadDown_deg = 15.0;

// brain: a mesh of the head, closed, for instance that of the case as it is. The same seed gives
// the same patient; case_id gets "-SEED" appended. All but tumour, craniotomy and gravity is as in
// the case. kNotConverged: no draw in 1,000 fits. Errors of geometry::ClosestPointIndex.
Result<CaseConfig> vary_patient(const CaseConfig& config, const TetMesh& brain, std::uint64_t seed);

}  // namespace brainshift::client
