// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <cmath>

#include "common/configuration/case_config.hpp"
#include "common/core/random.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/inversion/condensed/reason.hpp"
#include "common/inversion/condensed/robust_weights.hpp"
#include "common/values/quality.hpp"

namespace brainshift::inversion {
namespace {

SparseData whole(int size) {
  return {Points::Zero(3, size), Points::Zero(3, size), VecX::Ones(size)};
}

VecX gaussian_norms(int size, int rows, std::uint64_t seed) {
  Random random(seed);
  VecX norms(size);
  for (int i = 0; i < size; ++i) {
    double squares = 0.0;
    for (int k = 0; k < rows; ++k) squares += std::pow(random.normal(), 2);
    norms[i] = std::sqrt(squares);
  }
  return norms;
}

TEST(RobustWeights, LimitsAndMediansAreThoseOfTheChiDistribution) {
  const auto chi = [](int rows, double p) {
    return std::sqrt(boost::math::quantile(boost::math::chi_squared(rows), p));
  };
  EXPECT_NEAR(kMedianWhole, chi(3, 0.5), 1e-4);
  EXPECT_NEAR(kMedianAlong, chi(1, 0.5), 1e-5);
  EXPECT_NEAR(kOutlierWhole, chi(3, 1.0 - 5e-5), 0.01);
  EXPECT_NEAR(kOutlierAlong, chi(1, 1.0 - 5e-5), 0.01);
}

TEST(RobustWeights, GaussianDataKeepTheirFullWeight) {
  RobustWeights weights;
  weights.reset(300);
  EXPECT_FALSE(weights.update(whole(300), gaussian_norms(300, 3, 1)));
  EXPECT_EQ(weights.values().minCoeff(), 1.0);
  SparseData along = whole(300);
  along.directions = Points(Vec3(0, 0, 1).replicate(1, 300));
  EXPECT_FALSE(weights.update(along, gaussian_norms(300, 1, 2)));
  EXPECT_EQ(weights.values().minCoeff(), 1.0);
}

TEST(RobustWeights, AGrossErrorLosesItsInfluence) {
  VecX norms = gaussian_norms(100, 3, 3);
  norms[7] = 20.0;
  norms[8] = 200.0;
  RobustWeights weights;
  weights.reset(100);
  EXPECT_TRUE(weights.update(whole(100), norms));
  EXPECT_LT(weights.values()[7], 0.01);
  // What pulls is w r; it falls although the error is ten times as large.
  EXPECT_LT(weights.values()[8] * 200.0, 0.01 * weights.values()[7] * 20.0);
  EXPECT_EQ(weights.outliers(0, 100), 2);
  EXPECT_EQ(weights.outliers(9, 91), 0);
}

// Residuals come with the present weight inside.
TEST(RobustWeights, StayWhenTheResidualsDo) {
  VecX norms = gaussian_norms(100, 3, 3);
  norms[7] = 10.0;
  RobustWeights weights;
  weights.reset(100);
  ASSERT_TRUE(weights.update(whole(100), norms));
  const double weight = weights.values()[7];
  norms[7] *= std::sqrt(weight);
  EXPECT_FALSE(weights.update(whole(100), norms));
  EXPECT_NEAR(weights.values()[7], weight, 1e-12);
}

// A whole source that the model cannot explain is not a crowd of outliers.
// The caller takes them anew only when it is told to. Of a gross error a small change of the weight
// is a large part of it.
TEST(RobustWeights, StayWhereTheCallerIsToldThatTheyDo) {
  const VecX norms = gaussian_norms(100, 3, 3);
  RobustWeights weights;
  weights.reset(100);
  VecX residuals = norms;
  residuals[7] = 30.0;
  ASSERT_TRUE(weights.update(whole(100), residuals));
  for (int round = 0; round < 6; ++round) {
    residuals[7] = round % 2 == 0 ? 20.0 : 30.0;
    const VecX before = weights.values();
    ASSERT_FALSE(weights.update(whole(100), residuals.cwiseProduct(before.cwiseSqrt())));
    EXPECT_EQ(before, VecX(weights.values())) << round;
  }
  EXPECT_LT(weights.values()[7], 0.01);
}

// Boundary points that are measured anew may be fewer; what is known of the others' data stays.
TEST(RobustWeights, SourcesThatKeepTheirDataKeepTheirWeights) {
  SparseData data = whole(120);
  data.sources = {{"ius", 0, 100}, {"tracks", 100, 20}};
  VecX norms = gaussian_norms(120, 3, 7);
  norms[3] = norms[105] = 30.0;
  RobustWeights weights;
  weights.reset(120);
  ASSERT_TRUE(weights.update(data, norms));
  const double distrusted = weights.values()[105];
  ASSERT_LT(distrusted, 0.01);
  const auto before = data.sources;
  for (const int points : {98, 100, 300}) {  // fewer; as many; more than there was room for
    RobustWeights followed = weights;
    SparseData now = whole(points + 20);
    now.sources = {{"ius", 0, points}, {"tracks", points, 20}};
    followed.reserve(std::max(120, points + 20));  // as where data grow while they move
    followed.follow(before, now);
    ASSERT_EQ(followed.values().size(), points + 20);
    EXPECT_EQ(followed.values()[points + 5], distrusted);
    EXPECT_EQ(followed.values().head(points).minCoeff(), points == 100 ? weights.values()[3] : 1.0);
    EXPECT_EQ(followed.outliers(points, 20), 1);
  }
}

// One source has a point more and another one a point less: the total tells nothing.
TEST(RobustWeights, StayWithTheirSourceWhereOnlyTheTotalIsTheSame) {
  SparseData data = whole(120);
  data.sources = {{"ius", 0, 60}, {"tracks", 60, 20}, {"stereo", 80, 40}};
  VecX norms = gaussian_norms(120, 3, 7);
  norms[65] = 30.0;
  RobustWeights weights;
  weights.reset(120);
  ASSERT_TRUE(weights.update(data, norms));
  const double distrusted = weights.values()[65];
  const auto before = data.sources;
  data.sources = {{"ius", 0, 59}, {"tracks", 59, 20}, {"stereo", 79, 41}};
  weights.follow(before, data);
  EXPECT_EQ(weights.values()[64], distrusted);
  EXPECT_EQ(weights.outliers(0, 120), 1);
  data.sources.clear();  // as many data as before, of one nameless source
  weights.follow({}, data);
  EXPECT_EQ(weights.values()[64], distrusted);
}

TEST(RobustWeights, ASourceThatIsOffAsAWholeKeepsItsWeight) {
  SparseData data = whole(200);
  data.sources = {{"a", 0, 100}, {"b", 100, 100}};
  VecX norms = gaussian_norms(200, 3, 5);
  norms.tail(100) *= 10.0;
  RobustWeights weights;
  weights.reset(200);
  EXPECT_FALSE(weights.update(data, norms));
  data.sources.clear();  // together, most of the second half would be outliers of the first
  EXPECT_TRUE(weights.update(data, norms));
}

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

std::string reason(EstimateStatus outcome, Estimate estimate) {
  estimate.contact.iterations = 7;
  estimate.reason = "of the update before";
  set_reason(outcome, 250.0, estimate);
  return estimate.reason;
}
bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Reason, SaysHowTheSearchEnded) {
  Estimate estimate;
  EXPECT_EQ(reason(EstimateStatus::kConverged, estimate), "loads and contact settled in 7 steps");
  estimate.contact.decrement = 0.5;
  EXPECT_TRUE(has(reason(EstimateStatus::kDeadline, estimate), "deadline of 250 ms"));
  EXPECT_TRUE(has(reason(EstimateStatus::kDeadline, estimate), "0.5 standard deviations"));
  EXPECT_TRUE(has(reason(EstimateStatus::kIterationLimit, estimate), "loads did not settle"));
  estimate.contact.decrement = kDecrement;
  EXPECT_TRUE(
      has(reason(EstimateStatus::kIterationLimit, estimate), "places of the data did not settle"));
}

TEST(Reason, NamesWhatThePriorDoesNotExplain) {
  Estimate estimate;
  estimate.misfit_ratio = kUnexplainedMisfit;
  EXPECT_FALSE(has(reason(EstimateStatus::kConverged, estimate), "does not explain"));
  estimate.misfit_ratio = 1.01 * kUnexplainedMisfit;
  EXPECT_TRUE(has(reason(EstimateStatus::kConverged, estimate), "they lie 1.5 standard"));
  EXPECT_FALSE(has(reason(EstimateStatus::kConverged, estimate), "at its bound"));
  estimate.prior_at_bound[static_cast<std::size_t>(PriorPart::kOpening)] = true;
  EXPECT_TRUE(has(reason(EstimateStatus::kConverged, estimate), "strength of opening is at its"));
}

TEST(Reason, NamesSourcesWithOutliersOrContradictions) {
  Estimate estimate;
  estimate.sources.resize(3);
  estimate.sources[0].source = "quiet";
  estimate.sources[1].source = "noisy";
  estimate.sources[1].outliers = 3;
  estimate.sources[1].data = 200;
  estimate.sources[2].source = "contrary";
  estimate.sources[2].consistent = false;
  estimate.sources[2].chi_square = 300.0;
  estimate.sources[2].degrees_of_freedom = 200.0;
  append_sources(estimate);
  EXPECT_FALSE(has(estimate.reason, "quiet"));
  EXPECT_TRUE(has(estimate.reason, "3 of 200 data of \"noisy\" count less as outliers"));
  EXPECT_TRUE(has(estimate.reason,
                  "\"contrary\" contradicts the other sources: chi-square 300 for 200 degrees"));
  std::string text;
  append_outliers(0, 200, text);
  EXPECT_EQ(text, "");
  append_outliers(2, 200, text);
  EXPECT_EQ(text, "; 2 of 200 data count less as outliers");
}

// A source's name comes from a client and may be of any length.
TEST(Reason, CutsLongNames) {
  Estimate estimate;
  estimate.sources.resize(1);
  estimate.sources[0].source = std::string(5000, 'x');
  estimate.sources[0].outliers = 1;
  estimate.sources[0].consistent = false;
  append_sources(estimate);
  EXPECT_LT(estimate.reason.size(), 400U);
  EXPECT_TRUE(has(estimate.reason, "degrees of freedom"));
}

}  // namespace
}  // namespace brainshift::inversion
