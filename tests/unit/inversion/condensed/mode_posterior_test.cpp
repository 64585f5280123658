// SPDX-License-Identifier: GPL-3.0-or-later
// More of it in condensed_inverter_test.cpp.
#include <gtest/gtest.h>

#include "common/core/random.hpp"
#include "common/inversion/condensed/mode_posterior.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "tests/support/dense.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

using ModePosteriorTest = Condensed;

// p of the rows first ... first + count - 1 under given strengths, by the check itself.
double p_value(const Eigen::MatrixXd& j, int first, int count, const PriorStrengths& strengths,
               const PriorScaleValues& scales) {
  const Eigen::Index size = j.cols() - 1;
  const Eigen::MatrixXd own = j.middleRows(first, count);
  VecX prior(size);
  for (int i = 0; i < size; ++i) {
    prior[i] = std::pow(std::max(1e-4, strengths.scale_of(i, scales)), -2);
  }
  const Eigen::MatrixXd all_gram = j.leftCols(size).transpose() * j.leftCols(size);
  const Eigen::MatrixXd own_gram = own.leftCols(size).transpose() * own.leftCols(size);
  const VecX all_right = j.leftCols(size).transpose() * j.col(size);
  const VecX own_right = own.leftCols(size).transpose() * own.col(size);
  SourceCheck check;
  Consistency result;
  EXPECT_TRUE(check.run(all_gram, all_right, own_gram, own_right, prior, result));
  return result.p_value;
}

TEST_F(ModePosteriorTest, ASourceContradictsOnlyWhereTheMeanOverTheHypothesesSaysSo) {
  const auto brain = operators(Boundary::kFixed);
  const ModeWindow window{0, brain->num_modes()};
  ThreadTeam team(1);
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  ContactSystem system(*brain, window, 1.0, team);
  ContactReduction no_contact(*brain, window, system, team);
  const SparseData sagging = sagging_data(Boundary::kFixed, 0.3, 4);
  int agreed = 0, contradicted = 0, under_the_first = 0;
  for (int trial = 0; trial < 80; ++trial) {
    SparseData data = sagging;
    const int half = data.size() / 2, rest = data.size() - half;
    data.displacements *= 0.025;
    data.displacements.rightCols(rest).colwise() += Vec3(0.0, 0.01 * trial, 0.0);
    SampledOperators sampled(brain, locator, window, OutsideRegion::kExtend, team);
    sampled.reserve(data.size());
    ASSERT_TRUE(sampled.locate(data));
    sampled.sample(data, RemainderVariances::Ones(), VecX::Ones(data.size()));
    ModePosterior posterior(window);
    posterior.reserve(data.size());
    posterior.linearise(sampled, no_contact, false, team);
    PriorStrengths strengths(brain->part_columns, window, SparseData::kMaxCommonErrors, true, 0.0,
                             team);
    ASSERT_TRUE(strengths.fit(posterior.gram(), posterior.right_hand_side()));
    SourceCheck check;
    Consistency found;
    ASSERT_TRUE(posterior.check_source(sampled, strengths, {"pointer", half, rest}, check, found));
    double mean = 0.0;
    for (const Hypothesis& each : strengths.hypotheses()) {
      mean +=
          each.weight * p_value(sampled.free_body(), 3 * half, 3 * rest, strengths, each.scales);
    }
    const double held =
        p_value(sampled.free_body(), 3 * half, 3 * rest, strengths, strengths.held());
    if (held >= kInconsistent) {
      EXPECT_NEAR(found.p_value, held, 1e-6);
      ++under_the_first;
    } else if (mean >= kInconsistent) {
      EXPECT_GE(found.p_value, kInconsistent);
      EXPECT_LE(found.p_value, mean * (1.0 + 1e-6));
      ++agreed;
    } else {
      EXPECT_LT(found.p_value, kInconsistent);
      EXPECT_LE(found.p_value, mean * (1.0 + 1e-6));
      ++contradicted;
    }
  }
  EXPECT_GT(agreed, 0) << under_the_first << " " << contradicted;
  EXPECT_GT(contradicted, 0);
  EXPECT_GT(under_the_first, 0);
}

TEST_F(ModePosteriorTest, TheLinearModelHasWhatForcesDoToTheDataWhateverTheNumberOfThreads) {
  const auto brain = operators(Boundary::kContact);
  const ModeWindow window{0, brain->num_modes()};
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  const SparseData data = sagging_data(Boundary::kContact, 0.3, 4);
  Random random(2);
  contact::ActiveSet set(static_cast<std::size_t>(brain->num_slaves()));
  for (char& one : set) one = random.uniform() < 0.5 ? 1 : 0;
  ThreadTeam one_thread(1);
  ContactSystem system(*brain, window, 5.0, one_thread);
  ContactReduction model(*brain, window, system, one_thread);
  ASSERT_TRUE(model.activate(set));
  Eigen::MatrixXd first;
  for (const int threads : {1, 2, 3}) {
    ThreadTeam team(threads);
    SampledOperators sampled(brain, locator, window, OutsideRegion::kExtend, team);
    sampled.reserve(data.size());
    ASSERT_TRUE(sampled.locate(data));
    sampled.sample(data, RemainderVariances::Ones(), VecX::Ones(data.size()));
    ModePosterior posterior(window);
    posterior.reserve(data.size());
    posterior.linearise(sampled, model, false, team);
    const Eigen::MatrixXd found = posterior.jacobian();
    if (threads == 1) {
      const Eigen::MatrixXd free_body = sampled.free_body().leftCols(window.count);
      const Eigen::MatrixXd expected =
          free_body - sampled.contact(model.active()) * model.response().leftCols(window.count);
      ASSERT_GT((expected - free_body).norm(), 0.1 * expected.norm()) << "the test shows nothing";
      EXPECT_LT((found - expected).norm(), 1e-12 * expected.norm());
      first = found;
    }
    EXPECT_EQ(found, first) << threads;
  }
}

TEST_F(ModePosteriorTest, ALinearModelThatFollowsTheSetBeforeIsThatOfItsOwn) {
  const auto brain = operators(Boundary::kContact);
  const ModeWindow window{1, brain->num_modes() - 1};
  ThreadTeam team(2);
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  ContactSystem system(*brain, window, 5.0, team);
  ContactReduction model(*brain, window, system, team);
  const SparseData data = sagging_data(Boundary::kContact, 0.3, 4);
  SampledOperators sampled(brain, locator, window, OutsideRegion::kExtend, team);
  sampled.reserve(data.size());
  ASSERT_TRUE(sampled.locate(data));
  sampled.sample(data, RemainderVariances::Ones(), VecX::Ones(data.size()));
  ModePosterior following(window), own(window);
  following.reserve(data.size());
  own.reserve(data.size());
  Random random(2);
  const int slaves = brain->num_slaves();
  contact::ActiveSet set(static_cast<std::size_t>(slaves));
  for (char& one : set) one = random.uniform() < 0.5 ? 1 : 0;
  int followed = 0;
  for (int step = 0; step < 10; ++step) {
    ASSERT_TRUE(model.activate(set));
    following.linearise(sampled, model, step > 0, team);
    own.linearise(sampled, model, false, team);
    followed += model.changes() > 0 ? 1 : 0;
    const auto gram = own.gram(), found = following.gram();
    const Eigen::MatrixXd expected = gram.triangularView<Eigen::Lower>();
    const Eigen::MatrixXd difference = found.triangularView<Eigen::Lower>();
    EXPECT_LT((difference - expected).norm(), 1e-10 * expected.norm());
    EXPECT_LT((following.jacobian() - own.jacobian()).norm(), 1e-10 * own.jacobian().norm());
    EXPECT_LT((following.right_hand_side() - own.right_hand_side()).norm(),
              1e-10 * own.right_hand_side().norm());
    for (int i = 0; i < 3; ++i) {
      char& one = set[static_cast<std::size_t>(random.uniform() * slaves)];
      one = one ? 0 : 1;
    }
  }
  EXPECT_GT(followed, 8) << "the test shows nothing";
}

// Few data and many modes: the residual of data that the model explains is much smaller than their
// errors, and the ratio is 1 on average all the same.
TEST_F(ModePosteriorTest, TheMisfitRatioOfDataThatTheModelExplainsIsOne) {
  const auto brain = operators(Boundary::kFixed);
  const ModeWindow window{0, brain->num_modes()};
  ThreadTeam team(1);
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  ContactSystem system(*brain, window, 1.0, team);
  ContactReduction no_contact(*brain, window, system, team);
  SparseData data = sagging_data(Boundary::kFixed, 0.3, 4);
  data.sd_mm *= 0.02;
  SampledOperators sampled(brain, locator, window, OutsideRegion::kExtend, team);
  sampled.reserve(data.size());
  ASSERT_TRUE(sampled.locate(data));
  sampled.sample(data, RemainderVariances::Zero(), VecX::Ones(data.size()));
  const Eigen::MatrixXd modes = sampled.free_body().leftCols(window.count);
  const PriorStrengths strengths(brain->part_columns, window, SparseData::kMaxCommonErrors, false,
                                 0.0, team);
  ModePosterior posterior(window);
  posterior.reserve(data.size());
  Random random(3);
  double squares = 0.0, of_rows = 0.0;
  constexpr int kDraws = 100;
  for (int draw = 0; draw < kDraws; ++draw) {
    VecX z(window.count);
    for (int i = 0; i < window.count; ++i) z[i] = strengths.scale_of(i) * random.normal();
    const VecX moved = modes * z;
    for (int i = 0; i < data.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        data.displacements(axis, i) = sampled.sd(i) * (moved[3 * i + axis] + random.normal());
      }
    }
    sampled.sample(data, RemainderVariances::Zero(), VecX::Ones(data.size()));
    posterior.linearise(sampled, no_contact, false, team);
    ASSERT_TRUE(posterior.minimise(strengths));
    squares += std::pow(posterior.misfit().ratio, 2) / kDraws;
    of_rows += posterior.residual().squaredNorm() / (kDraws * static_cast<double>(sampled.rows()));
  }
  EXPECT_LT(of_rows, 0.8) << "the test shows nothing";
  EXPECT_NEAR(squares, 1.0, 0.1);
}

using Eigen::MatrixXd;

constexpr int kUnknowns = 30, kFirst = 80, kSecond = 60;

struct Problem {
  MatrixXd jacobian = MatrixXd(kFirst + kSecond, kUnknowns);
  VecX data = VecX(kFirst + kSecond), prior = VecX(kUnknowns);

  Consistency check_second() const {
    const MatrixXd own = jacobian.bottomRows(kSecond);
    const MatrixXd gram = jacobian.transpose() * jacobian, own_gram = own.transpose() * own;
    const VecX right = jacobian.transpose() * data;
    const VecX own_right = own.transpose() * data.tail(kSecond);
    Consistency result;
    EXPECT_TRUE(SourceCheck().run(gram, right, own_gram, own_right, prior, result));
    return result;
  }
};

VecX normal_vector(Random& random, Eigen::Index size) {
  VecX values(size);
  for (double& value : values) value = random.normal();
  return values;
}

// The second source sees ten of the unknowns only.
Problem drawn(std::uint64_t seed) {
  Random random(seed);
  Problem problem;
  for (double& value : problem.jacobian.reshaped()) value = random.normal();
  problem.jacobian.bottomRightCorner(kSecond, kUnknowns - 10).setZero();
  problem.prior = VecX::LinSpaced(kUnknowns, 0.5, 2.0);
  const VecX x = normal_vector(random, kUnknowns).cwiseQuotient(problem.prior.cwiseSqrt());
  problem.data = problem.jacobian * x + normal_vector(random, kFirst + kSecond);
  return problem;
}

TEST(SourceCheck, ConsistentSourcesHaveUniformPValues) {
  constexpr int kTrials = 400;
  int below_tenth = 0, below_half = 0;
  double sum = 0.0, degrees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Consistency result = drawn(static_cast<std::uint64_t>(trial)).check_second();
    below_tenth += result.p_value < 0.1;
    below_half += result.p_value < 0.5;
    sum += result.chi_square;
    degrees += result.degrees_of_freedom;
  }
  EXPECT_NEAR(below_tenth / static_cast<double>(kTrials), 0.1, 0.05);  // 3.3 standard errors
  EXPECT_NEAR(below_half / static_cast<double>(kTrials), 0.5, 0.08);
  EXPECT_NEAR(sum / degrees, 1.0, 0.05);
}

TEST(SourceCheck, DegreesOfFreedomAreWhatTheSourceCanSay) {
  EXPECT_NEAR(drawn(3).check_second().degrees_of_freedom, 10.0, 0.1);
}

// The statistic for a source with all its rows, from the covariance of the innovation, minus the
// rows that are noise to everyone, is the same up to the damping.
TEST(SourceCheck, EqualsTheInnovationStatisticOfTheRowsThatSeeTheUnknowns) {
  const Problem problem = drawn(11);
  const MatrixXd first = problem.jacobian.topRows(kFirst);
  const MatrixXd own = problem.jacobian.bottomRows(kSecond);
  MatrixXd information = first.transpose() * first;
  information.diagonal() += problem.prior;
  const VecX mean =
      test_support::solve_positive(information, first.transpose() * problem.data.head(kFirst));
  const VecX innovation = problem.data.tail(kSecond) - own * mean;
  MatrixXd covariance = own * test_support::solve_positive(information, own.transpose());
  covariance.diagonal().array() += 1.0;
  const double all = innovation.dot(test_support::solve_positive(covariance, innovation).col(0));
  const MatrixXd seen = own.leftCols(10);
  const VecX noise =
      innovation -
      seen * test_support::solve_positive(seen.transpose() * seen, seen.transpose() * innovation);
  EXPECT_NEAR(problem.check_second().chi_square, all - noise.squaredNorm(), 0.05);
}

TEST(SourceCheck, AShiftThatTheOthersWouldHaveSeenIsAContradiction) {
  Problem problem = drawn(5);
  ASSERT_GT(problem.check_second().p_value, 1e-3);
  problem.data.tail(kSecond) += problem.jacobian.bottomRows(kSecond) * VecX::Ones(kUnknowns);
  EXPECT_LT(problem.check_second().p_value, 1e-6);
}

TEST(SourceCheck, OtherSourcesThatAreNotPositiveDefiniteAreSaid) {
  const MatrixXd gram = MatrixXd::Identity(2, 2), own = 3.0 * MatrixXd::Identity(2, 2);
  Consistency result;
  EXPECT_FALSE(SourceCheck().run(gram, VecX::Zero(2), own, VecX::Zero(2), VecX::Ones(2), result));
}

}  // namespace
}  // namespace brainshift::inversion
