// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/pose_ascent.hpp"

#include <gtest/gtest.h>

#include "tests/unit/registration/blob_image.hpp"

namespace brainshift::registration {
namespace {

// - sum |T p_i - q_i|^2, whose maximum is known.
struct Correspondence {
  Points from, to;

  PoseValue operator()(const RigidTransform& T, const Vec3& centre) const {
    PoseValue value;
    value.valid = true;
    for (Eigen::Index i = 0; i < from.cols(); ++i) {
      const Vec3 x = T * from.col(i);
      const Vec3 off = x - to.col(i);
      value.value -= off.squaredNorm();
      value.gradient -= 2.0 * direction_gradient(x, off, centre);
    }
    return value;
  }
};

Correspondence known_motion(const RigidTransform& T) {
  Random random(1);
  Points points(3, 30);
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    points.col(i) = Vec3(20, 10, 5).cwiseProduct(random.direction());
  return {points, test::moved(T, points)};
}

TEST(PoseAscent, FindsAKnownMotion) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Vec6 xi;
    xi << 0.4 * random.direction(), 12.0 * random.direction();
    const RigidTransform T = rigid_increment(xi, Vec3::Zero());
    PoseAscentOptions options;
    options.max_iterations = 200;
    options.tolerance_mm = 1e-6;
    const PoseAscent result =
        ascend(known_motion(T), RigidTransform::Identity(), Vec3::Zero(), 12.0, options);
    EXPECT_TRUE(result.converged);
    EXPECT_TRUE(result.T.isApprox(T, 1e-5)) << "seed " << seed;
    EXPECT_LT(result.iterations, 60);
    EXPECT_GE(result.evaluations, result.iterations);
  }
}

TEST(PoseAscent, StaysWhereItIsAtTheTop) {
  const RigidTransform T = RigidTransform::Identity();
  const PoseAscent result = ascend(known_motion(T), T, Vec3::Zero(), 12.0);
  EXPECT_TRUE(result.converged);
  EXPECT_TRUE(result.T.isApprox(T, 1e-12));
}

TEST(PoseAscent, SaysThatItRanOutOfIterations) {
  PoseAscentOptions options;
  options.max_iterations = 2;
  const PoseAscent result = ascend(known_motion(RigidTransform(Eigen::Translation3d(30, 0, 0))),
                                   RigidTransform::Identity(), Vec3::Zero(), 12.0, options);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.iterations, 2);
  EXPECT_LE(result.T.translation().norm(), 2.0 * options.largest_step_mm + 1e-9);
}

TEST(PoseAscent, NeverTakesAPoseOutsideOfTheFunction) {
  const Correspondence motion = known_motion(RigidTransform(Eigen::Translation3d(8, 0, 0)));
  const auto fenced = [&](const RigidTransform& T, const Vec3& centre) {
    PoseValue value = motion(T, centre);
    value.valid = T.translation().norm() <= 5.0;
    return value;
  };
  const PoseAscent result = ascend(fenced, RigidTransform::Identity(), Vec3::Zero(), 12.0);
  EXPECT_TRUE(result.valid);
  EXPECT_LE(result.T.translation().norm(), 5.0);
  EXPECT_GT(result.T.translation().norm(), 4.5);
  const auto nowhere = [](const RigidTransform&, const Vec3&) { return PoseValue{}; };
  EXPECT_FALSE(ascend(nowhere, RigidTransform::Identity(), Vec3::Zero(), 12.0).valid);
}

}  // namespace
}  // namespace brainshift::registration
