// SPDX-License-Identifier: GPL-3.0-or-later
// A transform between two recorded ones, and a link's transform at any time.
//
// With A = Q_A S_A the polar decomposition of the linear part (Q a rotation, S symmetric; S = I
// for a rigid motion):
//   T(a) = [ slerp(Q_A, Q_B; a)  ((1 - a) S_A + a S_B)  |  (1 - a) t_A + a t_B ]
// The source frame's origin moves on a straight line, and its axes turn about one fixed axis at
// constant rate (Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985).
#pragma once

#include <optional>
#include <vector>

#include "common/core/types.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::tracking {

// a = 0 gives A, a = 1 gives B; outside [0, 1] it extrapolates.
AffineTransform interpolate(const AffineTransform& A, const AffineTransform& B, double a);

struct PoseTimeOptions {
  // Two samples farther apart than this say nothing about the time between them. Trackers record
  // 10 to 60 samples a second.
  double max_age_s = 0.2;
  // How far before the first or after the last sample a pose may be extrapolated.
  double max_extrapolation_s = 0.02;
};

enum class PoseOutcome { kOk, kInvalid, kMissing, kWithoutStatus, kStale, kOutsideTime };

struct PoseAtTime {
  PoseOutcome outcome = PoseOutcome::kMissing;
  AffineTransform T_to_from = AffineTransform::Identity();  // when kOk
};

// What a sample says of its own frame.
PoseAtTime own_pose(const Link& sample);

// The link at time t_s. time_s: of the frames, s, never decreasing, one per sample.
// A sample at that very time decides alone. Otherwise the nearest samples before and after it
// decide; frames without the transform are passed over. Both samples must be valid, since nothing
// is bridged across an invalid one, and at most max_age_s apart.
PoseAtTime pose_at(const std::vector<double>& time_s, const std::vector<Link>& samples, double t_s,
                   const PoseTimeOptions& options = {});

}  // namespace brainshift::tracking
