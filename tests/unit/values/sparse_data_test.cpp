// SPDX-License-Identifier: Apache-2.0
#include "common/values/sparse_data.hpp"

#include <gtest/gtest.h>

namespace brainshift {
namespace {

SparseData part(int size, double value, int common_errors) {
  SparseData data;
  data.positions = Points::Constant(3, size, value);
  data.displacements = Points::Constant(3, size, 10.0 * value);
  data.sd_mm = VecX::Constant(size, 100.0 * value);
  if (common_errors > 0) {
    data.common_error = Eigen::MatrixXd::Constant(3 * size, common_errors, value);
  }
  return data;
}

TEST(SparseData, ADatumAlongADirectionIsOneRowAWholeOneThree) {
  SparseData data = part(3, 1.0, 0);
  EXPECT_EQ(data.rows(), 9);
  data.directions = Points::Zero(3, 3);
  EXPECT_EQ(data.rows(), 9);
  data.directions.col(1) = Vec3::UnitY();
  EXPECT_TRUE(data.along_direction(1));
  EXPECT_FALSE(data.along_direction(0));
  EXPECT_EQ(data.rows(), 7);
}

TEST(CombinedSparseData, KeepsTheOrderAndMakesErrorsOfDifferentSourcesIndependent) {
  SparseData first = part(2, 1.0, 2), second = part(3, 2.0, 1);
  second.directions = Points::Zero(3, 3);
  second.directions.col(2) = Vec3::UnitZ();
  second.sources = {{"stereopsis", 0, 3}};
  const SparseData all = combine({first, second});
  ASSERT_EQ(all.size(), 5);
  EXPECT_EQ(all.positions.leftCols(2), first.positions);
  EXPECT_EQ(all.displacements.rightCols(3), second.displacements);
  EXPECT_EQ(all.sd_mm[4], 200.0);
  EXPECT_FALSE(all.along_direction(3));
  EXPECT_TRUE(all.along_direction(4));
  ASSERT_EQ(all.common_error.rows(), 15);
  ASSERT_EQ(all.common_error.cols(), 3);
  EXPECT_TRUE(all.common_error.topLeftCorner(6, 2).isConstant(1.0));
  EXPECT_TRUE(all.common_error.topRightCorner(6, 1).isZero(0.0));
  EXPECT_TRUE(all.common_error.bottomLeftCorner(9, 2).isZero(0.0));
  EXPECT_TRUE(all.common_error.bottomRightCorner(9, 1).isConstant(2.0));
  ASSERT_EQ(all.sources.size(), 2u);
  EXPECT_EQ(all.sources[0].name, "");
  EXPECT_EQ(all.sources[0].count, 2);
  EXPECT_EQ(all.sources[1].name, "stereopsis");
  EXPECT_EQ(all.sources[1].first, 2);
}

TEST(CombinedSparseData, OfNothingIsEmpty) {
  EXPECT_EQ(combine({}).size(), 0);
  EXPECT_EQ(combine({part(0, 1.0, 0)}).size(), 0);
}

// Errors whose size is known have variance 1 beside those whose size is not.
TEST(CombinedData, KeepTheVarianceOfEveryCommonError) {
  SparseData outlined = part(2, 1.0, 2);
  outlined.common_variance = Eigen::MatrixXd::Constant(2, kOutlineErrors.size(), 0.25);
  const SparseData all = combine({part(3, 2.0, 1), outlined, part(2, 3.0, 0)});
  ASSERT_EQ(all.common_variance.rows(), 3);
  ASSERT_EQ(all.common_variance.cols(), static_cast<Eigen::Index>(kOutlineErrors.size()));
  EXPECT_TRUE(all.common_variance.row(0).isOnes(0.0));
  EXPECT_TRUE(all.common_variance.bottomRows(2).isConstant(0.25));
  EXPECT_EQ(combine({part(3, 2.0, 1)}).common_variance.cols(), 0);
  SparseData small = part(2, 1.0, 1);  // of the shorter length alone
  small.common_variance.resize(1, 4);
  small.common_variance << 0.0, 0.1, 0.2, 0.3;
  const Eigen::MatrixXd both = combine({outlined, small}).common_variance;
  ASSERT_EQ(both.cols(), 7);
  EXPECT_EQ(both.row(2), (Eigen::RowVectorXd(7) << 0.0, 0.1, 0.2, 0.3, 0.1, 0.2, 0.3).finished());
}

}  // namespace
}  // namespace brainshift
