// SPDX-License-Identifier: Apache-2.0
#include "common/values/session_state.hpp"
#include "tests/support/results.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace brainshift {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_refused(const FieldChoice& choice, ErrorCode code, const std::string& sentence) {
  EXPECT_EQ(refusal_of(validate(choice), code), sentence) << "accepted: " << sentence;
}

FieldChoice ball(const Vec3& centre_mm, double radius_mm) {
  return {.region = BallRegion{centre_mm, radius_mm}};
}

TEST(FieldChoice, TheDefaultAndChoicesThatCombineAreValid) {
  EXPECT_TRUE(validate(FieldChoice{}));
  EXPECT_TRUE(validate(FieldChoice{TumourRegion{0.0}, 10.0, 0.1, false}));
  EXPECT_TRUE(validate(FieldChoice{TumourRegion{1000.0}, 1000.0, 100.0}));
  EXPECT_TRUE(validate(ball(Vec3(-1000, 0, 1000), 1e-9)));
}

TEST(FieldChoice, ALengthOutsideItsRangeIsNamedWithItsValue) {
  constexpr auto kBad = ErrorCode::kInvalidArgument;
  expect_refused(ball(Vec3::Zero(), -3.0), kBad,
                 "choice.ball.radius_mm = -3: must be in (0, 1000]");
  expect_refused(ball(Vec3::Zero(), 0.0), kBad, "choice.ball.radius_mm = 0: must be in (0, 1000]");
  expect_refused(ball(Vec3(0, 1001, 0), 1.0), kBad,
                 "choice.ball.centre_mm = 1001: must be in [-1000, 1000]");
  expect_refused({.region = TumourRegion{-1e-9}}, kBad,
                 "choice.tumour.margin_mm = -1e-09: must be in [0, 1000]");
  expect_refused({.spacing_mm = 1000.5}, kBad, "choice.spacing_mm = 1000.5: must be in [0, 1000]");
  expect_refused({.tolerance_mm = 101.0}, kBad, "choice.tolerance_mm = 101: must be in [0, 100]");
}

TEST(FieldChoice, WhatIsNoNumberIsNamed) {
  constexpr auto kBad = ErrorCode::kNotFinite;
  expect_refused(ball(Vec3(kNaN, 0, 0), 1.0), kBad,
                 "choice.ball.centre_mm = nan: must be a number");
  expect_refused(ball(Vec3::Zero(), kInfinity), kBad,
                 "choice.ball.radius_mm = inf: must be a number");
  expect_refused({.region = TumourRegion{kInfinity}}, kBad,
                 "choice.tumour.margin_mm = inf: must be a number");
  expect_refused({.spacing_mm = kNaN}, kBad, "choice.spacing_mm = nan: must be a number");
  expect_refused({.tolerance_mm = -kInfinity}, kBad,
                 "choice.tolerance_mm = -inf: must be a number");
}

TEST(FieldChoice, ChoicesAreEqualWhenEveryLengthIs) {
  EXPECT_EQ(ball(Vec3(1, 2, 3), 4.0), ball(Vec3(1, 2, 3), 4.0));
  EXPECT_NE(ball(Vec3(1, 2, 3), 4.0), ball(Vec3(1, 2, 3.5), 4.0));
  EXPECT_NE(FieldChoice{.region = TumourRegion{4.0}}, ball(Vec3::Zero(), 4.0));
  EXPECT_NE(FieldChoice{.with_sd = false}, FieldChoice{});
  EXPECT_NE(FieldChoice{.spacing_mm = 1.0}, FieldChoice{.tolerance_mm = 1.0});
}

}  // namespace
}  // namespace brainshift
