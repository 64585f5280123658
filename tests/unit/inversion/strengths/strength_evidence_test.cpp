// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/strengths/strength_evidence.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "common/core/random.hpp"
#include "tests/support/dense.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;

constexpr auto kAll = StrengthEvidence::Blocks::kAll,
               kOfEachPart = StrengthEvidence::Blocks::kOfEachPart;
constexpr int kShared = 2, kLoads = 30, kRows = 120;
constexpr PerPart<int> kCounts = {3, 0, 7, 0, 0, 0, 20, 0, 0};
constexpr std::size_t kPresentPart[] = {0, 2, 6};
// The evidence leaves out what changes ln p by less than about this.
constexpr double kLeftOut = 0.03;

struct Model {
  explicit Model(std::uint64_t seed) : jacobian(kRows, kShared + kLoads), data(kRows) {
    Random random(seed);
    for (Eigen::Index i = 0; i < jacobian.size(); ++i) jacobian.data()[i] = 0.4 * random.normal();
    for (double& value : data) value = 2.0 * random.normal();
  }
  MatrixXd gram() const { return jacobian.transpose() * jacobian; }
  VecX right() const { return jacobian.transpose() * data; }

  MatrixXd jacobian;  // whitened [common | modes]
  VecX data;          // whitened
};

VecX prior_variance(const PerPart<double>& variances) {
  VecX result = VecX::Ones(kShared + kLoads);
  int next = kShared;
  for (std::size_t part = 0; part < kCounts.size(); ++part) {
    result.segment(next, kCounts[part]).setConstant(variances[part]);
    next += kCounts[part];
  }
  return result;
}

// ln N(d; 0, I + J S^2 J^T) but for the data's own constant.
double log_evidence(const Model& model, const PerPart<double>& variances) {
  MatrixXd covariance =
      model.jacobian * prior_variance(variances).asDiagonal() * model.jacobian.transpose();
  covariance.diagonal().array() += 1.0;
  return -test_support::cholesky_factor(covariance).diagonal().array().log().sum() -
         0.5 * model.data.dot(test_support::solve_positive(covariance, model.data).col(0));
}

PerPart<double> of(double first, double second, double third) {
  return {first, 0, second, 0, 0, 0, third, 0, 0};
}

class StrengthEvidenceTest : public testing::Test {
 protected:
  StrengthEvidenceTest() : evidence(kCounts, kShared) {
    taken = evidence.take(model.gram(), model.right());
  }
  void SetUp() override { ASSERT_TRUE(taken); }

  Model model{7};
  StrengthEvidence evidence;
  StrengthEvidence::Workspace work;
  StrengthEvidence::Projection projection;
  bool taken = false;
};

TEST_F(StrengthEvidenceTest, DiffersBetweenStrengthsAsTheDensityOfTheDataDoes) {
  const auto base = of(1.0, 0.25, 4.0);
  double at_base = 0.0;
  ASSERT_TRUE(evidence.log_evidence(base, work, at_base));
  for (const auto& other : {of(0.0, 0.25, 4.0), of(16.0, 0.0, 0.0), of(64.0, 64.0, 64.0)}) {
    double found = 0.0;
    ASSERT_TRUE(evidence.log_evidence(other, work, found));
    EXPECT_NEAR(found - at_base, log_evidence(model, other) - log_evidence(model, base), kLeftOut);
  }
}

TEST_F(StrengthEvidenceTest, AProfileIsTheEvidenceOfEveryStrengthOfAPart) {
  PerPart<double> floors{};
  floors[6] = 0.04;
  const auto variances = of(0.0, 0.25, 4.04);
  PerPart<StrengthProfile> found{};
  ASSERT_TRUE(evidence.project(variances, kAll, projection, work));
  ASSERT_TRUE(evidence.profiles(projection, variances, floors, found, work));
  for (const std::size_t part : kPresentPart) {
    for (std::size_t i = 1; i < kStrengths.size(); ++i) {
      auto with = variances, without = variances;
      with[part] = kStrengths[i] * kStrengths[i] + floors[part];
      without[part] = floors[part];
      EXPECT_NEAR(found[part][i] - found[part][0],
                  log_evidence(model, with) - log_evidence(model, without), kLeftOut)
          << part << " at " << kStrengths[i];
    }
  }
}

TEST_F(StrengthEvidenceTest, ProfilesOfAChangedPartAreThoseOfTheChangedHypothesis) {
  const PerPart<double> floors{};
  const auto variances = of(1.0, 0.0, 4.0);
  StrengthEvidence::Projection changed_projection;
  PerPart<StrengthProfile> found{}, expected{};
  ASSERT_TRUE(evidence.project(variances, kAll, projection, work));
  for (const std::size_t part : kPresentPart) {
    for (const double variance : {0.0, 0.25, 64.0}) {
      auto changed = variances;
      changed[part] = variance;
      ASSERT_TRUE(
          evidence.changed_profiles(projection, variances, part, variance, floors, found, work));
      ASSERT_TRUE(evidence.project(changed, kOfEachPart, changed_projection, work));
      ASSERT_TRUE(evidence.profiles(changed_projection, changed, floors, expected, work));
      for (const std::size_t each : kPresentPart) {
        for (std::size_t i = 0; i < kStrengths.size(); ++i) {
          EXPECT_NEAR(found[each][i], expected[each][i], 1e-6) << part << ", " << each << ", " << i;
        }
      }
    }
  }
}

TEST_F(StrengthEvidenceTest, MomentsAreThoseOfTheLinearModel) {
  const auto variances = of(1.0, 0.25, 4.0);
  const VecX prior = prior_variance(variances);
  MatrixXd precision = model.gram();
  precision.diagonal() += prior.cwiseInverse();
  const MatrixXd covariance = test_support::inverse(precision);
  VecX mean(kShared + kLoads);
  ASSERT_TRUE(evidence.mean(variances, work, mean));
  EXPECT_LT((mean - covariance * model.right()).norm(), 1e-2 * mean.norm());

  MatrixXd explained(evidence.rank(), kLoads);
  ASSERT_TRUE(evidence.explained(variances, work, explained));
  const MatrixXd left =
      MatrixXd(prior.tail(kLoads).asDiagonal()) - explained.transpose() * explained;
  EXPECT_LT((left - covariance.bottomRightCorner(kLoads, kLoads)).cwiseAbs().maxCoeff(), 1e-2);
}

// Common errors whose variances are a hypothesis: as if their columns were multiplied by its roots.
TEST_F(StrengthEvidenceTest, AnErrorHypothesisIsThatOfScaledColumns) {
  MatrixXd variance(kShared, 3);
  variance << 1.0, 0.25, 0.0,  //
      0.0, 0.09, 1.0;
  ASSERT_TRUE(evidence.take(model.gram(), model.right(), variance));
  ASSERT_EQ(evidence.errors(), 3);
  double at_first = 0.0;
  ASSERT_TRUE(evidence.log_evidence({of(1.0, 0.25, 4.0), 0}, work, at_first));
  Model first = model;
  first.jacobian.leftCols(kShared) *= variance.col(0).cwiseSqrt().asDiagonal();
  for (int e = 0; e < 3; ++e) {
    Model scaled = model;
    const VecX roots = variance.col(e).cwiseSqrt();
    scaled.jacobian.leftCols(kShared) *= roots.asDiagonal();
    double found = 0.0;
    ASSERT_TRUE(evidence.log_evidence({of(16.0, 0.0, 1.0), e}, work, found));
    EXPECT_NEAR(found - at_first,
                log_evidence(scaled, of(16.0, 0.0, 1.0)) - log_evidence(first, of(1.0, 0.25, 4.0)),
                kLeftOut);
    MatrixXd precision = scaled.gram();
    precision.diagonal() += prior_variance(of(16.0, 0.0625, 1.0)).cwiseInverse();
    VecX expected = test_support::solve_positive(precision, scaled.right()).col(0);
    expected.head(kShared).array() *= roots.array();
    VecX mean(kShared + kLoads);
    ASSERT_TRUE(evidence.mean({of(16.0, 0.0625, 1.0), e}, work, mean));
    EXPECT_LT((mean - expected).norm(), 1e-2 * expected.norm());
  }
  EXPECT_TRUE(evidence.holds(model.gram(), model.right(), variance));
  EXPECT_FALSE(evidence.holds(model.gram(), model.right()));
}

TEST_F(StrengthEvidenceTest, HoldsOnlyWhatItWasGiven) {
  const MatrixXd gram = model.gram();
  VecX right = model.right();
  EXPECT_TRUE(evidence.holds(gram, right));
  right[3] += 1e-12;
  EXPECT_FALSE(evidence.holds(gram, right));
  evidence.forget();
  EXPECT_FALSE(evidence.holds(gram, model.right()));
}

TEST_F(StrengthEvidenceTest, NumbersThatAreNotFiniteAreRejected) {
  MatrixXd gram = model.gram();
  gram(4, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(evidence.take(gram, model.right()));
  VecX right = model.right();
  right[0] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(evidence.take(model.gram(), right));
}

TEST_F(StrengthEvidenceTest, DataThatSayNothingLeaveEveryStrengthAsProbable) {
  ASSERT_TRUE(evidence.take(MatrixXd::Zero(kLoads, kLoads), VecX::Zero(kLoads)));
  PerPart<StrengthProfile> found{};
  ASSERT_TRUE(evidence.project(of(1, 1, 1), kAll, projection, work));
  ASSERT_TRUE(evidence.profiles(projection, of(1, 1, 1), {}, found, work));
  for (const std::size_t part : kPresentPart) {
    for (const double log_p : found[part]) EXPECT_EQ(log_p, 0.0);
  }
}

}  // namespace
}  // namespace brainshift::inversion
