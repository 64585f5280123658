// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/sampling.hpp"

#include <gtest/gtest.h>

#include "common/core/random.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::fem {
namespace {

TEST(SamplingMatrix, ReproducesALinearField) {
  const TetMesh mesh = test_support::box_mesh(3, 3, 3, Vec3(30, 30, 30));
  const geometry::TetLocator locator(mesh);
  Mat3 gradient;
  gradient << 1, 2, 3, -1, 0, 4, 2, 2, -5;
  Random random(9);
  Points points(3, 50);
  for (int i = 0; i < points.cols(); ++i) {
    points.col(i) = 30.0 * Vec3(random.uniform(), random.uniform(), random.uniform());
  }
  const auto sampling = value_or_fail(sampling_matrix(locator, mesh.num_nodes(), points, 0.0));
  const Points field = gradient * mesh.nodes;
  const Points sampled = (sampling * field.transpose()).transpose();
  EXPECT_LT((sampled - gradient * points).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(SamplingMatrix, NamesThePointThatLiesOutside) {
  const TetMesh mesh = test_support::box_mesh(2, 2, 2, Vec3(30, 30, 30));
  const geometry::TetLocator locator(mesh);
  Points points(3, 2);
  points << 15, 15, 15, 15, 15, 37;
  EXPECT_TRUE(sampling_matrix(locator, mesh.num_nodes(), points, 8.0).has_value());
  EXPECT_THAT(refusal_of(sampling_matrix(locator, mesh.num_nodes(), points, 5.0),
                         ErrorCode::kInvalidArgument),
              testing::HasSubstr("point 1"));
}

}  // namespace
}  // namespace brainshift::fem
