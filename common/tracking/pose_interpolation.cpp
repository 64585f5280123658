// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/pose_interpolation.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "common/core/small_matrices.hpp"

namespace brainshift::tracking {
namespace {

// Times closer than this are the same: recordings write microseconds.
constexpr double kSameTime_s = 5e-7;

struct Polar {
  Eigen::Quaterniond rotation;
  Mat3 stretch;
};

Polar polar_decomposition(const Mat3& linear) {
  const SingularValues svd = singular_values(linear);
  Mat3 Q = svd.U * svd.V.transpose();
  if (Q.determinant() < 0.0) Q = -Q;  // a mirrored image: the sign goes to the stretch
  return {Eigen::Quaterniond(Q), Q.transpose() * linear};
}

PoseOutcome outcome_of(LinkStatus status) {
  switch (status) {
    case LinkStatus::kOk: return PoseOutcome::kOk;
    case LinkStatus::kInvalid: return PoseOutcome::kInvalid;
    case LinkStatus::kMissing: return PoseOutcome::kMissing;
    case LinkStatus::kWithoutStatus: return PoseOutcome::kWithoutStatus;
  }
  return PoseOutcome::kMissing;
}

// The two samples that decide: the last at or before t and the first after it, or the two at one
// end.
struct Bracket {
  std::size_t first, second;
  double outside_s;  // how far t lies beyond them
};

std::optional<Bracket> find_bracket(const std::vector<double>& time_s,
                                    const std::vector<Link>& samples, double t_s) {
  std::vector<std::size_t> present;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].status == LinkStatus::kMissing) continue;
    const bool again = !present.empty() && time_s[i] - time_s[present.back()] < kSameTime_s;
    if (!again) present.push_back(i);
  }
  if (present.size() < 2) return std::nullopt;
  const auto after =
      std::upper_bound(present.begin(), present.end(), t_s,
                       [&](double t, std::size_t sample) { return t < time_s[sample]; });
  auto second = static_cast<std::size_t>(after - present.begin());
  second = std::clamp<std::size_t>(second, 1, present.size() - 1);
  Bracket bracket{present[second - 1], present[second], 0.0};
  bracket.outside_s = std::max({0.0, time_s[bracket.first] - t_s, t_s - time_s[bracket.second]});
  return bracket;
}

}  // namespace

AffineTransform interpolate(const AffineTransform& A, const AffineTransform& B, double a) {
  const Polar from = polar_decomposition(A.linear());
  const Polar to = polar_decomposition(B.linear());
  AffineTransform T = AffineTransform::Identity();
  T.linear() = from.rotation.slerp(a, to.rotation).toRotationMatrix() *
               ((1.0 - a) * from.stretch + a * to.stretch);
  T.translation() = (1.0 - a) * A.translation() + a * B.translation();
  return T;
}

PoseAtTime own_pose(const Link& sample) { return {outcome_of(sample.status), sample.T_to_from}; }

PoseAtTime pose_at(const std::vector<double>& time_s, const std::vector<Link>& samples, double t_s,
                   const PoseTimeOptions& options) {
  const auto near = std::lower_bound(time_s.begin(), time_s.end(), t_s - kSameTime_s);
  for (auto i = static_cast<std::size_t>(near - time_s.begin());
       i < time_s.size() && time_s[i] <= t_s + kSameTime_s; ++i) {
    if (samples[i].status == LinkStatus::kMissing) continue;
    return own_pose(samples[i]);
  }
  const auto bracket = find_bracket(time_s, samples, t_s);
  if (!bracket) return {PoseOutcome::kMissing, {}};
  const Link& first = samples[bracket->first];
  const Link& second = samples[bracket->second];
  if (first.status != LinkStatus::kOk) return {outcome_of(first.status), {}};
  if (second.status != LinkStatus::kOk) return {outcome_of(second.status), {}};
  const double span_s = time_s[bracket->second] - time_s[bracket->first];
  if (span_s > options.max_age_s) return {PoseOutcome::kStale, {}};
  if (bracket->outside_s > options.max_extrapolation_s) return {PoseOutcome::kOutsideTime, {}};
  const double a = (t_s - time_s[bracket->first]) / span_s;
  return {PoseOutcome::kOk, interpolate(first.T_to_from, second.T_to_from, a)};
}

}  // namespace brainshift::tracking
