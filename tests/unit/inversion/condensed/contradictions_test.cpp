// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/contradictions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/random.hpp"

namespace brainshift::inversion {
namespace {

// A row of data 5 mm apart, sd 0.2 mm, noise to match; data 3 and 7 then share a place.
SparseData row_of(int size) {
  SparseData data{Points::Zero(3, size), Points::Zero(3, size), VecX::Constant(size, 0.2)};
  Random random(5);
  for (int i = 0; i < size; ++i) {
    data.positions.col(i) = Vec3(5.0 * i, 0.3 * i, 0.0);
    for (int axis = 0; axis < 3; ++axis) data.displacements(axis, i) = 0.2 * random.normal();
  }
  return data;
}

SparseData pair_of(const Vec3& apart, const Vec3& differ) {
  SparseData data = row_of(12);
  data.positions.col(7) = data.positions.col(3) + apart;
  data.displacements.col(7) = data.displacements.col(3) + differ;
  return data;
}

Contradiction find(const SparseData& data) {
  Contradictions search;
  search.reserve(data.size());
  return search.find(data);
}

TEST(Contradictions, APairAtOnePlaceIsNamedWithItsDistanceInStandardDeviations) {
  const SparseData data = pair_of(Vec3::Zero(), Vec3(0, 6, 8));
  const Contradiction found = find(data);
  EXPECT_EQ(found.first, 3);
  EXPECT_EQ(found.second, 7);
  EXPECT_EQ(found.pairs, 1);
  EXPECT_NEAR(found.differ_mm, 10.0, 1e-12);
  EXPECT_NEAR(found.sds, 10.0 / (0.2 * std::sqrt(2.0)), 1e-9);
  std::string reason = "contact holds";
  append_contradiction(found, data, reason);
  EXPECT_EQ(reason,
            "contact holds; data 3 and 7 at one place, (15.0 0.9 0.0) mm, contradict each other by "
            "10.0 mm (35 sd)");
}

TEST(Contradictions, WhatChanceExplainsIsNone) {
  EXPECT_EQ(find(row_of(12)).pairs, 0);
  EXPECT_EQ(find(pair_of(Vec3::Zero(), Vec3(0.5, 0.5, 0.5))).pairs, 0);  // 3.1 sd
  std::string reason = "contact holds";
  append_contradiction({}, row_of(3), reason);
  EXPECT_EQ(reason, "contact holds");
}

TEST(Contradictions, NeighboursMayStretchAndFarDataMayDiffer) {
  const Vec3 differ(0, 1.6, 0);  // 5.7 sd
  EXPECT_EQ(find(pair_of(Vec3::Zero(), differ)).pairs, 1);
  EXPECT_EQ(find(pair_of(Vec3(0, 0, 0.5), differ)).pairs, 0);
  EXPECT_EQ(find(pair_of(Vec3(0, 0, 0.5), 3.0 * differ)).pairs, 1);
  EXPECT_EQ(find(pair_of(Vec3(0, 0, 1.5), 9.0 * differ)).pairs, 0);
}

TEST(Contradictions, OnlyWhatBothMeasureIsCompared) {
  SparseData data = pair_of(Vec3::Zero(), Vec3(0, 6, 0));
  data.directions = Points::Zero(3, data.size());
  data.directions.col(7) = Vec3::UnitZ();  // measures nothing of a difference along y
  EXPECT_EQ(find(data).pairs, 0);
  data.directions.col(7) = Vec3::UnitY();
  EXPECT_EQ(find(data).pairs, 1);
  data.directions.col(3) = -Vec3::UnitY();
  EXPECT_EQ(find(data).pairs, 1);
  data.directions.col(3) = Vec3::UnitZ();  // different parts
  EXPECT_EQ(find(data).pairs, 0);
}

// An error that both have cancels; one that only one of them has explains the difference.
TEST(Contradictions, TheCommonErrorCountsAsFarAsThePairDoesNotShareIt) {
  SparseData data = pair_of(Vec3::Zero(), Vec3(0, 3, 0));
  data.common_error = Eigen::MatrixXd::Zero(3 * data.size(), 1);
  data.common_error.col(0).segment<3>(9) = Vec3(0, 5, 0);
  EXPECT_EQ(find(data).pairs, 0);
  data.common_error.col(0).segment<3>(21) = Vec3(0, 5, 0);
  EXPECT_EQ(find(data).pairs, 1);
}

TEST(Contradictions, TheWorstOfSeveralIsNamedInWhateverOrderTheDataCome) {
  for (const double other_mm : {2.0, 9.0}) {
    SparseData data = pair_of(Vec3::Zero(), Vec3(0, 4, 0));
    data.positions.col(0) = data.positions.col(11);
    data.displacements.col(0) = data.displacements.col(11) + Vec3(other_mm, 0, 0);
    const Contradiction found = find(data);
    EXPECT_EQ(found.first, other_mm < 4.0 ? 3 : 0);
    EXPECT_EQ(found.second, other_mm < 4.0 ? 7 : 11);
    EXPECT_EQ(found.pairs, 2);
    std::string reason;
    append_contradiction(found, data, reason);
    EXPECT_THAT(reason, testing::HasSubstr("the worst of 2 such pairs"));
  }
}

}  // namespace
}  // namespace brainshift::inversion
