// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/misplacement.hpp"

#include <gtest/gtest.h>

namespace brainshift::geometry {
namespace {

TEST(Misplacement, NamesTheMistakeThatExplainsThePoints) {
  Points right(3, 2);
  right << 30, 34, -20, -24, 40, 44;
  const auto mistake = [&](const Vec3& factors) {
    return likely_mistake(factors.asDiagonal() * right,
                          [&](const Points& meant) { return (meant - right).norm() < 1e-6; });
  };
  EXPECT_EQ(mistake(Vec3(-1, -1, 1)), "; in LPS instead of RAS?");
  EXPECT_EQ(mistake(Vec3::Constant(1e-3)), "; in metres instead of millimetres?");
  EXPECT_EQ(mistake(Vec3(-1e-3, -1e-3, 1e-3)), "; in metres, and in LPS instead of RAS?");
  EXPECT_EQ(mistake(Vec3::Constant(0.1)), "; in centimetres instead of millimetres?");
  EXPECT_EQ(mistake(Vec3::Constant(1e3)), "; in micrometres instead of millimetres?");
  EXPECT_EQ(mistake(Vec3(-1, 1, 1)), "; with left and right exchanged?");
  EXPECT_EQ(mistake(Vec3(1, 1, 7)), "");
}

TEST(Misplacement, PointsThatAreNoneAreNoMistake) {
  const auto always = [](const Points&) { return true; };
  EXPECT_EQ(likely_mistake(Points(3, 0), always), "");
  EXPECT_EQ(likely_mistake(Points::Constant(3, 1, std::nan("")), always), "");
}

TEST(Misplacement, APlaceInMetresIsNearTheOriginAndMeantInTheHead) {
  const auto in_head = [](const Vec3& x) { return x.norm() < 100.0; };
  EXPECT_EQ(metres_for_millimetres(Vec3(0.046, -0.047, 0.009), in_head),
            "lies within 0.1 mm of the origin; in metres it would be (46.0, -47.0, 9.0) mm");
  EXPECT_EQ(metres_for_millimetres(Vec3(0.2, 0.0, 0.0), in_head), "") << "200 mm is no head";
  EXPECT_EQ(metres_for_millimetres(Vec3::Zero(), in_head), "");
  const auto anywhere = [](const Vec3&) { return true; };
  EXPECT_EQ(metres_for_millimetres(Vec3(1, -2, 0), anywhere), "");
}

}  // namespace
}  // namespace brainshift::geometry
