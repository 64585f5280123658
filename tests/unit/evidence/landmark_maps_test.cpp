// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/landmark_study.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

namespace brainshift::evidence {
namespace {

using testing::HasSubstr;

Points places() {
  Points p(3, 8);
  p << 0, 30, 5, -3, 22, 18, -10, 9,  //
      0, 2, 25, 6, 20, -7, 15, 9,     //
      0, -4, 3, 28, 8, 19, -6, 9;
  return p;
}

Points motion() {
  Points d(3, 8);
  d << 1.0, 2.0, 0.0, 0.4, 1.1, -0.8, 0.2, 2.5,  //
      0.0, -1.0, 1.5, 0.4, 0.3, 0.9, -1.3, 0.6,  //
      0.5, 0.2, -0.7, 2.0, -0.6, 0.1, 0.7, -1.2;
  return d;
}

const Vec3 kInside(12, 3, 5), kOutside(-20, 40, 10);

TEST(RigidMap, GivesARigidMotionBack) {
  RigidTransform T = RigidTransform::Identity();
  T.rotate(Eigen::AngleAxisd(0.1, Vec3(1, 2, 2).normalized()));
  T.pretranslate(Vec3(1, -2, 3));
  const auto map = value_or_fail(rigid_map(places(), T * places()));
  EXPECT_LT((map(kOutside) - T * kOutside).norm(), 1e-9);
}

TEST(AffineAndThinPlateMap, GiveAnAffineMapBack) {
  Eigen::Matrix3d a;
  a << 1.02, 0.01, -0.03, 0.0, 0.97, 0.02, 0.04, -0.01, 1.01;
  const Vec3 t(2, -1, 0.5);
  for (const auto make : {affine_map, thin_plate_map}) {
    const auto map = value_or_fail(make(places(), (a * places()).colwise() + t));
    EXPECT_LT((map(kOutside) - (a * kOutside + t)).norm(), 1e-9);
  }
}

// Values of scipy.interpolate.RBFInterpolator (1.10), kernel "linear", degree 1.
TEST(ThinPlateMap, GoesThroughEveryPairAndAgreesWithScipy) {
  const auto map = value_or_fail(thin_plate_map(places(), places() + motion()));
  for (int i = 0; i < 8; ++i) {
    EXPECT_LT((map(places().col(i)) - places().col(i) - motion().col(i)).norm(), 1e-9);
  }
  EXPECT_LT((map(kInside) - Vec3(13.74470951, 3.20953111, 4.47579501)).norm(), 1e-7);
  EXPECT_LT((map(kOutside) - Vec3(-20.54958832, 40.67029511, 10.70941547)).norm(), 1e-7);
}

TEST(LandmarkMaps, RefuseWhatDoesNotSetThem) {
  Points flat = places();
  flat.row(2).setZero();
  Points twice = places();
  twice.col(3) = twice.col(4);
  for (const auto make : {affine_map, thin_plate_map}) {
    EXPECT_THAT(make(flat, places()).error().message, HasSubstr("one plane"));
    EXPECT_THAT(make(places().leftCols(3), places().leftCols(3)).error().message,
                HasSubstr("at least 4"));
    EXPECT_THAT(make(places(), places().leftCols(5)).error().message, HasSubstr("8 before and 5"));
  }
  EXPECT_THAT(thin_plate_map(twice, places()).error().message, HasSubstr("one place"));
  EXPECT_FALSE(rigid_map(places(), places().leftCols(5)));
}

}  // namespace
}  // namespace brainshift::evidence
