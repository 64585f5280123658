// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/data_check.hpp"
#include "tests/support/results.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace brainshift::inversion {
namespace {

SparseData good_data() {
  SparseData data;
  data.positions.resize(3, 4);
  data.positions << 25, 35, 30, 30, 30, 30, 25, 35, 40, 41, 42, 38;
  data.displacements = Points::Constant(3, 4, -1.0);
  data.sd_mm = VecX::Constant(4, 0.2);
  return data;
}

void expect_refused(const SparseData& data, ErrorCode code, const std::string& words) {
  EXPECT_THAT(refusal_of(check_data(data), code), testing::HasSubstr(words));
}

TEST(CheckData, AcceptsDataInGeneralPosition) { EXPECT_TRUE(check_data(good_data()).has_value()); }

// A plane of data does not see what tissue does across it.
TEST(CheckData, RefusesCoplanarPositions) {
  SparseData data = good_data();
  data.positions.row(2).setConstant(40);
  expect_refused(data, ErrorCode::kInvalidArgument, "in one plane");
}

TEST(CheckData, RefusesNeighboursThatContradictEachOther) {
  SparseData data = good_data();
  data.positions.col(1) = data.positions.col(0) + Vec3(0.5, 0.7, 1.1);
  data.displacements.col(1) = data.displacements.col(0) + Vec3(0, 12, 0);
  EXPECT_TRUE(check_data(data).has_value());
  data.displacements.col(1) = data.displacements.col(0) + Vec3(0, 20, 0);
  expect_refused(data, ErrorCode::kInvalidArgument, "points 0 and 1 contradict each other");
}

TEST(CheckData, RefusesDirectionsThatAreNotUnitVectors) {
  SparseData data = good_data();
  data.directions = Points::Zero(3, 4);
  data.directions.col(2) = Vec3::UnitX();
  EXPECT_TRUE(check_data(data).has_value());
  data.directions.col(2) = Vec3(1, 1, 0);
  expect_refused(data, ErrorCode::kInvalidArgument, "direction 2 has length 1.41");
  data.directions(0, 2) = std::numeric_limits<double>::quiet_NaN();
  expect_refused(data, ErrorCode::kNotFinite, "direction 2");
  data.directions.conservativeResize(3, 3);
  expect_refused(data, ErrorCode::kInvalidArgument, "3 directions for 4 data");
}

TEST(CheckData, RefusesSourcesThatDoNotCoverTheData) {
  SparseData data = good_data();
  data.sources = {{"ius", 0, 3}, {"pointer", 3, 1}};
  EXPECT_TRUE(check_data(data).has_value());
  data.sources[1].first = 2;
  expect_refused(data, ErrorCode::kInvalidArgument,
                 "\"pointer\" begins at datum 2, must begin at 3");
  data.sources.pop_back();
  expect_refused(data, ErrorCode::kInvalidArgument, "hold 3 of 4 data");
}

TEST(CheckData, MethodsThatTakeWholeDisplacementsRefuseDistances) {
  SparseData data = good_data();
  EXPECT_TRUE(check_whole(data).has_value());
  data.directions = Points::Zero(3, 4);
  data.directions.col(3) = Vec3::UnitZ();
  EXPECT_THAT(sentence_of(check_whole(data)), testing::HasSubstr("datum 3"));
}

TEST(CheckData, RefusesFewerThanThreePoints) {
  SparseData data = good_data();
  data.positions.conservativeResize(3, 2);
  data.displacements.conservativeResize(3, 2);
  data.sd_mm.conservativeResize(2);
  expect_refused(data, ErrorCode::kInvalidArgument, "2 points");
  expect_refused(SparseData{Points(3, 0), Points(3, 0), VecX(0)}, ErrorCode::kInvalidArgument,
                 "0 points");
}

TEST(CheckData, RefusesCountsThatDiffer) {
  SparseData data = good_data();
  data.sd_mm.conservativeResize(3);
  expect_refused(data, ErrorCode::kInvalidArgument, "4 positions, 4 displacements and 3 standard");
}

TEST(CheckData, RefusesVariancesOfCommonErrorsThatDoNotFit) {
  SparseData data = good_data();
  data.common_error = Eigen::MatrixXd::Ones(3 * data.size(), 2);
  data.common_variance = Eigen::MatrixXd::Constant(2, kOutlineErrors.size(), 0.5);
  EXPECT_TRUE(check_data(data).has_value());
  data.common_variance(1, 3) = 1.5;
  expect_refused(data, ErrorCode::kInvalidArgument, "common_variance holds a value outside 0 to 1");
  data.common_variance = Eigen::MatrixXd::Ones(3, 4);
  expect_refused(data, ErrorCode::kInvalidArgument, "common_variance is 3 x 4: must have 2 rows");
  data.common_variance = Eigen::MatrixXd::Ones(2, 8);
  expect_refused(data, ErrorCode::kInvalidArgument, "and at most 7 columns");
}

TEST(CheckData, NamesTheDatumThatIsNotFinite) {
  for (double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    SparseData data = good_data();
    data.positions(1, 2) = bad;
    expect_refused(data, ErrorCode::kNotFinite, "point 2");
    data = good_data();
    data.displacements(0, 1) = bad;
    expect_refused(data, ErrorCode::kNotFinite, "point 1");
    data = good_data();
    data.sd_mm[3] = bad;
    expect_refused(data, ErrorCode::kNotFinite, "point 3");
  }
}

TEST(CheckData, RefusesAStandardDeviationThatIsNotPositive) {
  for (double bad : {0.0, -0.2}) {
    SparseData data = good_data();
    data.sd_mm[1] = bad;
    expect_refused(data, ErrorCode::kInvalidArgument, "sd_mm[1]");
  }
}

TEST(CheckData, RefusesCollinearAndCoincidentPositions) {
  SparseData data = good_data();
  for (int i = 0; i < 4; ++i) data.positions.col(i) = Vec3(30, 30, 35) + i * Vec3(1, 2, -1);
  expect_refused(data, ErrorCode::kInvalidArgument, "one line");
  data.positions.colwise() = Vec3(30, 30, 40);
  expect_refused(data, ErrorCode::kInvalidArgument, "one point");
}

}  // namespace
}  // namespace brainshift::inversion
