// SPDX-License-Identifier: GPL-3.0-or-later
// Maps from places before surgery to places during it that need no model of the brain, fitted to
// pairs (x_i, y_i) of landmarks. What an estimate is held against.
//
//   rigid        y = R x + t       least squares (registration/fiducials.hpp)
//   affine       y = A x + t       least squares
//   thin plate   y = A x + t + sum_i w_i |x - x_i|,  sum_i w_i = 0,  sum_i w_i x_i^T = 0
//                through every pair, with the least bending energy in space (Bookstein 1989, IEEE
//                TPAMI 11:567; the kernel of three dimensions is |x|)
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/io/landmarks/pair_file.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::evidence {

using PointMap = std::function<Vec3(const Vec3&)>;

// before, during: 3 x n, mm. Errors of register_fiducials.
Result<PointMap> rigid_map(const Points& before, const Points& during);
// kInvalidArgument when the numbers differ, below 4, or when all lie in one plane.
Result<PointMap> affine_map(const Points& before, const Points& during);
// The same; kInvalidArgument also when two places before surgery are one.
Result<PointMap> thin_plate_map(const Points& before, const Points& during);

// Landmarks of a real operation, leave-one-out: each landmark is predicted from the others alone,
// by maps that know no brain and by the daemon's estimate.
//
// The image during surgery may be misregistered by some degrees, which rigid motion of the tissue
// looks like. The estimate's way, from the pairs (x_j, y_j) other than landmark i:
//   T0  rigid fit, as a registration before the update would find it
//   u   the update from the pairs (x_j, T0^-1 y_j), with kLeftPose as what T0 may be off by
//   T   rigid fit of x_j + u(x_j) to y_j: what the update puts down to the pose
//   y_i is predicted at T (x_i + u(x_i))
// Nothing of landmark i is read but x_i, and y_i to score.
//
// The prediction's own standard deviation, of a component: the update's at x_i, what T is off by
// there (Fitzpatrick's TRE for landmarks of sd s) and the landmark's own:
//   sd_i^2 = sd(x_i)^2 + TRE(y_i)^2 / 3 + s^2
inline constexpr double kLeftPose_mm = 2.0;
inline constexpr double kLeftPose_deg = 2.0;

// How the patient lay is not published with the landmarks: every study is made with both.
struct HeadPose {
  std::string name;
  Vec3 gravity = Vec3(0, -1, 0);
};
// "uppermost": the case's direction of gravity, away from the opening. "supine": (0, -1, 0).
std::vector<HeadPose> head_poses(const CaseConfig& config);

// Distances from where a landmark was found to where it was predicted, mm.
struct LeftOutLandmark {
  std::string name;   // or its number, from 1
  double none = 0.0;  // at its place before surgery
  double rigid = 0.0, affine = 0.0, thin_plate = 0.0;
  double estimate = 0.0;
  double motion_mm = 0.0;  // |u| there
  double sd_mm = 0.0;      // of a component of the prediction
  int inside = 0;          // components, of three, within the 90 % interval
  std::string quality;     // of the update
};

// sd_mm: of a landmark. The head's case needs nothing but its prior; sensing is set as above.
// kInvalidArgument with fewer than 5 pairs; errors of the maps and of the update, with the
// landmark's name.
Result<std::vector<LeftOutLandmark>> leave_one_out(const bench::Head& head,
                                                   const io::NamedPairs& pairs, double sd_mm);

}  // namespace brainshift::evidence
