// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/symmetric_matrix.hpp"

#include <gtest/gtest.h>

namespace brainshift::linalg {
namespace {

// [ 2 -1 0 ; -1 3 4 ; 0 4 -5 ] by its lower triangle.
SymmetricMatrix lower() {
  SymmetricMatrix matrix(3, 3);
  const std::vector<Eigen::Triplet<double>> entries = {
      {0, 0, 2.0}, {1, 0, -1.0}, {1, 1, 3.0}, {2, 1, 4.0}, {2, 2, -5.0}};
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST(SymmetricMatrix, MultipliesByTheWholeMatrix) {
  EXPECT_EQ(multiply(lower(), Vec3(1.0, 2.0, 3.0)), VecX(Vec3(0.0, 17.0, -7.0)));
}

TEST(SymmetricMatrix, NormIsTheLargestRowSumOfTheWholeMatrix) {
  EXPECT_EQ(max_norm(lower()), 9.0);  // of the last row
  EXPECT_EQ(max_norm(SymmetricMatrix()), 0.0);
}

}  // namespace
}  // namespace brainshift::linalg
