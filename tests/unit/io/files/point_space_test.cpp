// SPDX-License-Identifier: GPL-3.0-or-later
// The frame that a model file names; whole files are in io/geometry.
#include "common/io/files/point_space.hpp"

#include <gmock/gmock.h>

#include <string>

namespace brainshift::io {
namespace {

using testing::Eq;

TEST(PointSpace, BlanksAroundTheValueDoNotCount) {
  EXPECT_EQ(parse_point_space("RAS").value(), PointSpace::kRas);
  EXPECT_EQ(parse_point_space(" LPS\r\n").value(), PointSpace::kLps);
}

TEST(PointSpace, AnyOtherValueIsNamedInOneShortPrintableLine) {
  const auto message = [](std::string_view value) {
    const auto space = parse_point_space(value);
    return space ? std::string("accepted") : space.error().message;
  };
  EXPECT_THAT(message(""), Eq("SPACE is '': must be RAS or LPS"));
  EXPECT_THAT(message("ras"), Eq("SPACE is 'ras': must be RAS or LPS"));
  EXPECT_THAT(message("R A\nS\x1b"), Eq("SPACE is 'R A?S?': must be RAS or LPS"));
  EXPECT_THAT(message(std::string(5000, 'x')),
              Eq("SPACE is '" + std::string(20, 'x') + "...': must be RAS or LPS"));
}

TEST(PointSpace, OnlyAWordOfItsOwnInAHeadingNamesTheSpace) {
  EXPECT_EQ(point_space_in("3D Slicer output. SPACE=LPS").value(), PointSpace::kLps);
  EXPECT_EQ(point_space_in("SPACE=RAS and more").value(), PointSpace::kRas);
  EXPECT_EQ(point_space_in("COLOURSPACE=sRGB SPACE=LPS").value(), PointSpace::kLps);
  EXPECT_EQ(point_space_in("COLOURSPACE=sRGB").value(), PointSpace::kUnsaid);
  EXPECT_EQ(point_space_in("made in SPACE").value(), PointSpace::kUnsaid);
  EXPECT_FALSE(point_space_in("SPACE="));
}

TEST(PointSpace, LpsIsHalfATurnAndTheOthersStay) {
  const Points written = Points::Identity(3, 3);
  for (const PointSpace same : {PointSpace::kUnsaid, PointSpace::kRas}) {
    Points points = written;
    turn_to_ras(same, points);
    EXPECT_EQ(points, written);
  }
  Points points = written;
  turn_to_ras(PointSpace::kLps, points);
  EXPECT_EQ(points, Points(Vec3(-1.0, -1.0, 1.0).asDiagonal() * written));
  EXPECT_GT(Mat3(points).determinant(), 0.0) << "no mirror";
}

}  // namespace
}  // namespace brainshift::io
