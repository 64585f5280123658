// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/init/position.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Vec3 gravity(const std::string& position) { return value_or_fail(gravity_of_position(position)); }

void expect_close(const Vec3& a, const Vec3& b) { EXPECT_LT((a - b).norm(), 1e-12) << a; }

TEST(Position, GravityPointsToWhatThePatientLiesOn) {
  expect_close(gravity("supine"), Vec3(0, -1, 0));
  expect_close(gravity("prone"), Vec3(0, 1, 0));
  expect_close(gravity("sitting"), Vec3(0, 0, -1));
  expect_close(gravity("left-lateral"), Vec3(-1, 0, 0));
  expect_close(gravity("right-lateral"), Vec3(1, 0, 0));
}

TEST(Position, AFaceTurnedToTheSidePutsThatEarDown) {
  expect_close(gravity("supine,left-90"), Vec3(-1, 0, 0));
  expect_close(gravity("supine, right-90"), Vec3(1, 0, 0));
  expect_close(gravity("supine,left-30"), Vec3(-0.5, -std::sqrt(0.75), 0));
  expect_close(gravity("prone,left-90"), Vec3(1, 0, 0));  // the right cheek on the pillow
}

TEST(Position, ChinToChestBringsGravityTowardsFeetOrFace) {
  expect_close(gravity("supine,flexed-90"), gravity("sitting"));
  expect_close(gravity("sitting,flexed-90"), Vec3(0, 1, 0));
  expect_close(gravity("supine,extended-90"), Vec3(0, 0, 1));
  expect_close(gravity("sitting,tilted-left-90"), Vec3(-1, 0, 0));
}

TEST(Position, ARaisedHeadEndBringsGravityTowardsTheFeetHoweverTheHeadIsTurned) {
  expect_close(gravity("supine,raised-90"), Vec3(0, 0, -1));
  expect_close(gravity("prone,lowered-30"), Vec3(0, std::sqrt(0.75), 0.5));
  expect_close(gravity("supine,left-90,raised-30"), Vec3(-std::sqrt(0.75), 0, -0.5));
}

TEST(Position, OfTwoTurnsTheSecondIsAboutTheTurnedHeadsAxes) {
  // Turned by a quarter, the head's flexion is about the floor's vertical: nothing changes.
  expect_close(gravity("supine,left-90,flexed-40"), Vec3(-1, 0, 0));
  EXPECT_GT((gravity("supine,flexed-40,left-90") - Vec3(-1, 0, 0)).norm(), 0.1);
}

TEST(Position, WhatIsWrongIsQuoted) {
  const auto refusal = [](const std::string& position) {
    return refusal_of(gravity_of_position(position), ErrorCode::kInvalidArgument);
  };
  EXPECT_THAT(refusal("standing"), AllOf(HasSubstr("\"standing\""), HasSubstr("sitting")));
  EXPECT_THAT(refusal(""), HasSubstr("must begin with"));
  EXPECT_THAT(refusal("supine,left"), HasSubstr("\"left\""));
  EXPECT_THAT(refusal("supine,left-x"), HasSubstr("0 to 180"));
  EXPECT_THAT(refusal("supine,flexed-91"), HasSubstr("0 to 90"));
  EXPECT_THAT(refusal("supine,west-30"), HasSubstr("as in supine,left-30"));
  EXPECT_THAT(refusal("sitting,raised-30"), HasSubstr("level"));
}

}  // namespace
}  // namespace brainshift::client
