// SPDX-License-Identifier: GPL-3.0-or-later
// Candidates: measurements that could be made next, as places of the undeformed patient.
//
//   kind     is                                           observation
//   sweep    tracked ultrasound over a part of the        TumourBoundary
//            tumour's boundary
//   cortex   stereo pictures of a part of the exposed     CorticalSurface, points only
//            cortex
//   point    a pointer at a place that is found again     LandmarkPairs, kTouches equal pairs
//            (a fork of vessels, a target)
// A point is touched kTouches times: three pairs are the fewest that an observation holds.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/observation.hpp"

namespace brainshift::advice {

enum class Kind { kSweep, kCortex, kPoint };
std::string_view to_string(Kind kind);  // "sweep", "cortex", "point"

struct Candidate {
  std::string name;
  Kind kind = Kind::kSweep;
  Points places;  // 3 x m, undeformed, mm RAS

  Vec3 centre() const { return places.rowwise().mean(); }
};

inline constexpr double kPointsPerMm2 = 1.0;  // of sweeps and cortex
inline constexpr int kTouches = 3;

// Eight sectors of the tumour's boundary, octants about its centroid; four patches of the exposed
// cortex, by the two principal axes through its centroid, and the fork nearest to the middle of
// each; the place of the tumour nearest to the opening. Named by where they lie from the middle:
// "tumour boundary, right anterior superior". Fewer where the model has no such part: a sector of
// less than 50 places, a patch without a triangle.
std::vector<Candidate> default_candidates(const BrainModel& model);

// From a table with the heading name,kind,x,y,z,radius_mm (mm RAS, undeformed; as Heading::place
// reads it). sweep and cortex: what of the surface lies within the radius of the place; point: the
// place, and no radius. kNotFound, kUnreadable, kEmptySet, kInvalidArgument: names file and line;
// also for a name that occurs twice and a place where there is nothing to measure.
Result<std::vector<Candidate>> read_candidates(const std::filesystem::path& path,
                                               const BrainModel& model);

// What the instrument would see: the places moved by `displacement` (3 x m), with the noise that
// the case states (sd_mm 0). source: "advice"; sequence 1.
Observation observed(const Candidate& candidate, const Points& displacement);

}  // namespace brainshift::advice
