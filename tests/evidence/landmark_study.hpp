// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks of a real operation, leave-one-out: each landmark is predicted from the others alone,
// by maps that know no brain (landmark_maps.hpp) and by the daemon's estimate.
//
// The image during surgery may be misregistered by some degrees, which rigid motion of the tissue
// looks like. The estimate's way, from the pairs (x_j, y_j) other than landmark i:
//   T0  rigid fit, as a registration before the update would find it
//   u   the update from the pairs (x_j, T0^-1 y_j), with kLeftPose as what T0 may be off by
//   T   rigid fit of x_j + u(x_j) to y_j: what the update puts down to the pose
//   y_i is predicted at T (x_i + u(x_i))
// Nothing of landmark i is read but x_i, and y_i to score.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/landmarks/pair_file.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::evidence {

inline constexpr double kLeftPose_mm = 2.0;
inline constexpr double kLeftPose_deg = 2.0;

// Distances from where a landmark was found to where it was predicted, mm.
struct LeftOutLandmark {
  std::string name;
  double none = 0.0;  // at its place before surgery
  double rigid = 0.0, affine = 0.0, thin_plate = 0.0;
  double estimate = 0.0;
  double motion_mm = 0.0;  // |u| there
  std::string quality;     // of the update
};

// sd_mm: of a landmark. The head's case needs nothing but its prior; sensing is set as above.
// kInvalidArgument with fewer than 5 pairs; errors of the maps and of the update, with the
// landmark's name.
Result<std::vector<LeftOutLandmark>> leave_one_out(const bench::Head& head,
                                                   const io::NamedPairs& pairs, double sd_mm);

}  // namespace brainshift::evidence
