// SPDX-License-Identifier: GPL-3.0-or-later
// Where a stylus was held still: the points that a user touched, out of the path of its tip.
//
// A hold is a run of poses that lie within radius_mm of their mean for at least least_s, without a
// gap in time above gap_s. Runs are taken as long as they go, from the first pose on. Neighbouring
// runs whose means lie within 2 radius_mm are one hold that the tracker's noise had cut.
// A hold's point is the mean over the middle 80 % of its poses: the first and the last ones still
// have some of the way there and back.
//
// Assumption: the tracker's noise is independent from pose to pose and well below radius_mm. What
// all poses of a hold share (a bent tip, a wrong calibration) does not average out and is not in
// the spread.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

// A pose of the tip that the tracker vouches for.
struct TipSample {
  double time_s = 0.0;
  Vec3 tip = Vec3::Zero();  // mm
};

struct HoldOptions {
  double radius_mm = 1.0;  // a hand holds a tip in a divot within a few tenths of a millimetre
  double least_s = 1.0;    // a hand on its way does not stay so near for so long
  double gap_s = 0.25;
};

struct HeldPoint {
  double from_s = 0.0, to_s = 0.0;
  int poses = 0;            // averaged
  Vec3 tip = Vec3::Zero();  // their mean, mm
  double spread_mm = 0.0;   // their rms distance from the mean
};

// Samples in order of time. Holds in order of time; none is no error. kInvalidArgument: an option
// that is not positive, named as HoldOptions names it. kNotFinite: a sample.
Result<std::vector<HeldPoint>> find_holds(const std::vector<TipSample>& samples,
                                          const HoldOptions& options = {});

}  // namespace brainshift::client
