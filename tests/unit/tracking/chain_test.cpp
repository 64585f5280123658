// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/chain.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <limits>

namespace brainshift::tracking {
namespace {

using testing::HasSubstr;

AffineTransform pose(double angle, const Vec3& translation) {
  AffineTransform T = AffineTransform::Identity();
  T.linear() = Eigen::AngleAxisd(angle, Vec3(2, 1, -1).normalized()).toRotationMatrix();
  T.translation() = translation;
  return T;
}

AffineTransform probe_pose(double t_s) { return pose(0.2 + t_s, Vec3(10 + 40 * t_s, -5, 800)); }

Recording recording() {
  Recording result;
  result.width = result.height = 1;
  LinkSeries probe{{"Probe", "Tracker"}, {}}, reference{{"Reference", "Tracker"}, {}};
  for (int i = 0; i < 8; ++i) {
    result.time_s.push_back(0.1 * i);
    result.image_ok.push_back(1);
    probe.samples.push_back({probe_pose(0.1 * i), LinkStatus::kOk});
    reference.samples.push_back({pose(-0.4, Vec3(1, 2, 700)), LinkStatus::kOk});
  }
  result.links = {probe, reference};
  return result;
}

std::vector<ConstantLink> constants() {
  AffineTransform T_probe_image = pose(1.0, Vec3(3, 4, 5));
  T_probe_image.linear() *= 0.1;
  return {{{"Image", "Probe"}, T_probe_image}, {{"Reference", "Ras"}, pose(0.6, Vec3(-9, 8, 7))}};
}

AffineTransform expected(double t_s) {
  const auto links = constants();
  return links[1].T_to_from * pose(-0.4, Vec3(1, 2, 700)).inverse() * probe_pose(t_s) *
         links[0].T_to_from;
}

TEST(Chain, IsTheProductOfItsLinks) {
  const auto chain = value_or_fail(evaluate_chain(recording(), constants(), "Image", "Ras"));
  EXPECT_EQ(chain.used, 8);
  EXPECT_TRUE(chain.dropped.empty());
  EXPECT_THAT(chain.links, testing::ElementsAre("ImageToProbe", "ProbeToTracker",
                                                "ReferenceToTracker", "ReferenceToRas"));
  for (int i = 0; i < 8; ++i) {
    const auto& T = chain.T_target_source[static_cast<std::size_t>(i)];
    ASSERT_TRUE(T);
    EXPECT_LT((T->matrix() - expected(0.1 * i).matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Chain, LatencyTakesThePoseOfAnEarlierTime) {
  ChainOptions options;
  options.latency_s = 0.04;
  const auto chain =
      value_or_fail(evaluate_chain(recording(), constants(), "Image", "Ras", options));
  for (int i = 1; i < 8; ++i) {
    const auto& T = chain.T_target_source[static_cast<std::size_t>(i)];
    ASSERT_TRUE(T);
    EXPECT_LT((T->matrix() - expected(0.1 * i - 0.04).matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
  EXPECT_FALSE(chain.T_target_source[0]);  // before the first sample
  EXPECT_EQ(chain.why_not[0], "ProbeToTracker was not tracked at that time");
}

TEST(Chain, AFramesOwnPoseCountsWhateverItsTimeIs) {
  Recording still = recording();
  still.time_s.assign(8, 0.0);
  const auto chain = value_or_fail(evaluate_chain(still, constants(), "Image", "Ras"));
  for (int i = 0; i < 8; ++i) {
    const auto& T = chain.T_target_source[static_cast<std::size_t>(i)];
    ASSERT_TRUE(T);
    EXPECT_LT((T->matrix() - expected(0.1 * i).matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
  ChainOptions options;
  options.latency_s = 0.04;
  EXPECT_THAT(refusal_of(evaluate_chain(still, constants(), "Image", "Ras", options),
                         ErrorCode::kInvalidArgument),
              HasSubstr("frames 0 and 1 have the time 0 s and different poses"));
  for (Link& sample : still.links[0].samples) sample.T_to_from = probe_pose(0.0);
  EXPECT_TRUE(evaluate_chain(still, constants(), "Image", "Ras", options)) << "one pose";
}

TEST(Chain, CountsDroppedFramesByReasonAndFirstFrame) {
  Recording broken = recording();
  broken.image_ok[1] = 0;
  broken.links[0].samples[3].status = LinkStatus::kInvalid;
  broken.links[0].samples[6].status = LinkStatus::kInvalid;
  broken.links[1].samples[4].status = LinkStatus::kWithoutStatus;
  const auto chain = value_or_fail(evaluate_chain(broken, constants(), "Image", "Ras"));
  EXPECT_EQ(chain.used, 4);
  ASSERT_EQ(chain.dropped.size(), 3U);
  EXPECT_EQ(chain.dropped[0].reason, "the image is invalid");
  EXPECT_EQ(chain.dropped[1].reason, "ProbeToTracker is invalid");
  EXPECT_EQ(chain.dropped[1].count, 2);
  EXPECT_EQ(chain.dropped[1].first_frame, 3);
  EXPECT_EQ(chain.dropped[2].reason, "ReferenceToTracker has no status");
  for (const std::size_t frame : {1U, 3U, 4U, 6U}) EXPECT_FALSE(chain.T_target_source[frame]);
}

TEST(Chain, ALinkAbsentForTooLongIsTooOld) {
  Recording gap = recording();
  for (const std::size_t frame : {3U, 4U})
    gap.links[0].samples[frame].status = LinkStatus::kMissing;
  const auto chain = value_or_fail(evaluate_chain(gap, constants(), "Image", "Ras"));
  EXPECT_EQ(chain.used, 6);
  EXPECT_EQ(chain.why_not[3], "ProbeToTracker is too old");
}

TEST(Chain, WithoutConnectionNamesTheFrames) {
  Recording broken = recording();
  broken.links.pop_back();
  EXPECT_THAT(sentence_of(evaluate_chain(broken, constants(), "Image", "Ras")),
              testing::AllOf(HasSubstr("no chain from Image to Ras"), HasSubstr("Reference")));
}

TEST(Chain, OptionsOutOfRangeAreNamed) {
  ChainOptions options;
  options.latency_s = 2.0;
  auto chain = evaluate_chain(recording(), constants(), "Image", "Ras", options);
  EXPECT_THAT(sentence_of(chain), HasSubstr("latency = 2 s"));
  options = {};
  options.time.max_age_s = std::numeric_limits<double>::quiet_NaN();
  chain = evaluate_chain(recording(), constants(), "Image", "Ras", options);
  EXPECT_THAT(sentence_of(chain), HasSubstr("max age"));
  options = {};
  options.time.max_extrapolation_s = -1.0;
  chain = evaluate_chain(recording(), constants(), "Image", "Ras", options);
  EXPECT_THAT(sentence_of(chain), HasSubstr("max extrapolation = -1 s"));
}

}  // namespace
}  // namespace brainshift::tracking
