// SPDX-License-Identifier: GPL-3.0-or-later
// Paths of known shape: where the tip rested is found, and nothing else.
#include "client/tools/import/held_points.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "common/core/random.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

constexpr double kPeriod_s = 0.05;

// A path made of rests and straight moves.
class Path {
 public:
  void rest(const Vec3& at, double seconds, double noise_mm = 0.0) {
    at_ = at;
    for (double t = 0.0; t < seconds; t += kPeriod_s) {
      add(at + noise_mm * Vec3(random_.normal(), random_.normal(), random_.normal()));
    }
  }
  void move(const Vec3& to, double seconds) {
    const Vec3 from = at_;
    for (double t = kPeriod_s; t < seconds; t += kPeriod_s) add(from + t / seconds * (to - from));
    at_ = to;
  }
  void pause(double seconds) { time_s_ += seconds; }
  std::vector<TipSample> samples;

 private:
  void add(const Vec3& tip) {
    samples.push_back({time_s_, tip});
    time_s_ += kPeriod_s;
  }
  Vec3 at_ = Vec3::Zero();
  double time_s_ = 0.0;
  Random random_{7};
};

TEST(HeldPoints, EveryRestIsFoundAndAveraged) {
  Path path;
  path.rest(Vec3(0, 0, 0), 2.0, 0.15);
  path.move(Vec3(80, 0, 0), 1.0);
  path.rest(Vec3(80, 0, 0), 3.0, 0.15);
  path.move(Vec3(80, 60, 20), 1.0);
  path.rest(Vec3(80, 60, 20), 1.5, 0.15);
  const auto held = value_or_fail(find_holds(path.samples));
  ASSERT_THAT(held, SizeIs(3));
  const Vec3 places[] = {Vec3(0, 0, 0), Vec3(80, 0, 0), Vec3(80, 60, 20)};
  for (std::size_t i = 0; i < 3; ++i) {
    // The mean of some 25 poses is five times as near as one pose.
    EXPECT_LT((held[i].tip - places[i]).norm(), 0.15) << i;
    EXPECT_NEAR(held[i].spread_mm, 0.15 * std::sqrt(3.0), 0.07) << i;
  }
  EXPECT_NEAR(held[1].from_s, 3.0, 0.11);
  EXPECT_NEAR(held[1].to_s, 5.95, 0.16);
  EXPECT_GT(held[1].poses, 40);
}

TEST(HeldPoints, TheWayThereAndBackDoesNotPullThePoint) {
  Path path;
  path.rest(Vec3(-20, 0, 0), 0.3);
  path.move(Vec3(0, 0, 0), 2.0);  // 0.5 mm from pose to pose: the last ones lie within the radius
  path.rest(Vec3(0, 0, 0), 2.0);
  const auto held = value_or_fail(find_holds(path.samples));
  ASSERT_THAT(held, SizeIs(1));
  EXPECT_LT(held[0].tip.norm(), 1e-9);
}

TEST(HeldPoints, ASlowMotionOrAShortRestIsNoHold) {
  Path path;
  path.rest(Vec3(0, 0, 0), 0.8);
  path.move(Vec3(100, 0, 0), 20.0);  // 5 mm in a second
  path.rest(Vec3(100, 0, 0), 0.8);
  EXPECT_THAT(*find_holds(path.samples), SizeIs(0));
  HoldOptions shorter;
  shorter.least_s = 0.5;
  EXPECT_THAT(*find_holds(path.samples, shorter), SizeIs(2));
}

TEST(HeldPoints, ALostTrackerEndsARunAndNotAHold) {
  Path path;
  path.rest(Vec3(5, 5, 5), 1.5);
  path.pause(1.0);
  path.rest(Vec3(5.3, 5, 5), 1.5);
  const auto held = value_or_fail(find_holds(path.samples));
  ASSERT_THAT(held, SizeIs(1));
  EXPECT_NEAR(held[0].to_s, 3.95, 0.06);
  // Neither part is long enough by itself where the tracker was lost between them.
  HoldOptions longer;
  longer.least_s = 2.0;
  EXPECT_THAT(*find_holds(path.samples, longer), SizeIs(0));
}

TEST(HeldPoints, TheSamePlaceLaterIsAnotherHold) {
  Path path;
  path.rest(Vec3(0, 0, 0), 1.5);
  path.move(Vec3(50, 0, 0), 0.5);
  path.rest(Vec3(50, 0, 0), 1.5);
  path.move(Vec3(0, 0, 0), 0.5);
  path.rest(Vec3(0, 0, 0), 1.5);
  EXPECT_THAT(*find_holds(path.samples), SizeIs(3));
}

TEST(HeldPoints, NothingGivesNothing) {
  EXPECT_THAT(*find_holds({}), SizeIs(0));
  EXPECT_THAT(*find_holds({{0.0, Vec3(1, 2, 3)}}), SizeIs(0));
}

TEST(HeldPoints, RefusesWhatIsNoPathAndOptionsOutOfRange) {
  const auto refusal = [](const std::vector<TipSample>& samples, const HoldOptions& options) {
    const auto held = find_holds(samples, options);
    return held ? std::string() : held.error().message;
  };
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(refusal({}, {bad, 1.0, 0.25}), HasSubstr("radius_mm = "));
    EXPECT_THAT(refusal({}, {1.0, bad, 0.25}), HasSubstr("least_s = "));
    EXPECT_THAT(refusal({}, {1.0, 1.0, bad}), HasSubstr("gap_s = "));
  }
  EXPECT_THAT(refusal({{0.0, Vec3::Zero()}, {1.0, Vec3(0, std::nan(""), 0)}}, {}),
              HasSubstr("pose 1 of the tip is not finite"));
}

}  // namespace
}  // namespace brainshift::client
