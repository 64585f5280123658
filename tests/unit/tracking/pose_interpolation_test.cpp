// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/pose_interpolation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace brainshift::tracking {
namespace {

// A screw turns at constant rate about an axis and moves at constant velocity: the motion that
// interpolation reproduces exactly.
AffineTransform screw(double t_s) {
  AffineTransform T = AffineTransform::Identity();
  T.linear() = Eigen::AngleAxisd(0.3 + 2.0 * t_s, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  T.translation() = Vec3(100, -50, 900) + t_s * Vec3(30, 5, -12);
  return T;
}

struct Track {
  std::vector<double> time_s;
  std::vector<Link> samples;
};

Track track() {
  Track result;
  for (int i = 0; i < 10; ++i) {
    result.time_s.push_back(50.0 + 0.1 * i);
    result.samples.push_back({screw(0.1 * i), LinkStatus::kOk});
  }
  return result;
}

double difference(const AffineTransform& a, const AffineTransform& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

TEST(Interpolate, FollowsAScrewExactly) {
  for (const double a : {0.0, 0.25, 0.5, 1.0, 1.2, -0.2}) {
    EXPECT_LT(difference(interpolate(screw(1.0), screw(1.1), a), screw(1.0 + 0.1 * a)), 1e-12) << a;
  }
}

TEST(Interpolate, KeepsTheScaleOfImages) {
  AffineTransform A = screw(1.0) * Eigen::Scaling(0.08, 0.07, 0.08);
  AffineTransform B = screw(1.1) * Eigen::Scaling(0.08, 0.07, 0.08);
  const AffineTransform M = interpolate(A, B, 0.5);
  EXPECT_LT(difference(M, screw(1.05) * Eigen::Scaling(0.08, 0.07, 0.08)), 1e-12);
  // A mirrored image too.
  A = A * Eigen::Scaling(-1.0, 1.0, 1.0), B = B * Eigen::Scaling(-1.0, 1.0, 1.0);
  EXPECT_LT(difference(interpolate(A, B, 0.5), M * Eigen::Scaling(-1.0, 1.0, 1.0)), 1e-12);
}

TEST(Interpolate, TakesTheShortWayRound) {
  AffineTransform A = AffineTransform::Identity(), B = A;
  A.linear() = Eigen::AngleAxisd(-3.0, Vec3::UnitZ()).toRotationMatrix();
  B.linear() = Eigen::AngleAxisd(3.0, Vec3::UnitZ()).toRotationMatrix();
  const Mat3 middle = interpolate(A, B, 0.5).linear();
  EXPECT_NEAR(middle(0, 0), -1.0, 1e-12);  // half a turn, not none
}

TEST(PoseAt, IsTheSampleAtItsTimeAndTheScrewBetween) {
  const Track t = track();
  for (const double at : {0.0, 0.1, 0.123, 0.55, 0.9}) {
    const auto pose = pose_at(t.time_s, t.samples, 50.0 + at);
    ASSERT_EQ(pose.outcome, PoseOutcome::kOk) << at;
    EXPECT_LT(difference(pose.T_to_from, screw(at)), 1e-9) << at;
  }
}

TEST(PoseAt, ExtrapolatesNoFartherThanAllowed) {
  const Track t = track();
  for (const double at : {-0.015, 0.915}) {
    const auto pose = pose_at(t.time_s, t.samples, 50.0 + at);
    ASSERT_EQ(pose.outcome, PoseOutcome::kOk) << at;
    EXPECT_LT(difference(pose.T_to_from, screw(at)), 1e-9);
  }
  for (const double at : {-0.025, 0.925, 5.0}) {
    EXPECT_EQ(pose_at(t.time_s, t.samples, 50.0 + at).outcome, PoseOutcome::kOutsideTime) << at;
  }
}

TEST(PoseAt, NeverBridgesAnInvalidSample) {
  Track t = track();
  t.samples[4].status = LinkStatus::kInvalid;
  for (const double at : {0.35, 0.4, 0.45}) {
    EXPECT_EQ(pose_at(t.time_s, t.samples, 50.0 + at).outcome, PoseOutcome::kInvalid) << at;
  }
  EXPECT_EQ(pose_at(t.time_s, t.samples, 50.25).outcome, PoseOutcome::kOk);
}

TEST(PoseAt, BridgesMissingSamplesUpToTheGreatestAge) {
  Track t = track();
  t.samples[4].status = LinkStatus::kMissing;
  const auto pose = pose_at(t.time_s, t.samples, 50.4, {0.25, 0.0});
  ASSERT_EQ(pose.outcome, PoseOutcome::kOk);
  EXPECT_LT(difference(pose.T_to_from, screw(0.4)), 1e-9);
  EXPECT_EQ(pose_at(t.time_s, t.samples, 50.4, {0.15, 0.0}).outcome, PoseOutcome::kStale);
}

TEST(PoseAt, NeverUsesAMatrixWithoutStatus) {
  Track t = track();
  for (Link& link : t.samples) link.status = LinkStatus::kWithoutStatus;
  EXPECT_EQ(pose_at(t.time_s, t.samples, 50.4).outcome, PoseOutcome::kWithoutStatus);
}

TEST(PoseAt, WithoutTwoSamplesThereIsNothingBetween) {
  Track t = track();
  for (std::size_t i = 1; i < t.samples.size(); ++i) t.samples[i].status = LinkStatus::kMissing;
  EXPECT_EQ(pose_at(t.time_s, t.samples, 50.05).outcome, PoseOutcome::kMissing);
  EXPECT_EQ(pose_at(t.time_s, t.samples, 50.0).outcome, PoseOutcome::kOk);
}

TEST(PoseAt, TheFirstOfTwoSamplesAtOneTimeCounts) {
  Track t = track();
  t.time_s[5] = t.time_s[4];
  const auto pose = pose_at(t.time_s, t.samples, 50.45, {0.3, 0.0});
  ASSERT_EQ(pose.outcome, PoseOutcome::kOk);
  EXPECT_LT(difference(pose.T_to_from, screw(0.45)), 1e-9) << "between samples 4 and 6";
}

}  // namespace
}  // namespace brainshift::tracking
