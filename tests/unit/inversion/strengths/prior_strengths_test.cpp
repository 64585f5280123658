// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/strengths/prior_strengths.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "common/core/random.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;

constexpr int kModes = 48, kCommon = 2, kData = 300;
constexpr ModeWindow kWindow{0, kModes};
// Four parts; the model lacks the others.
constexpr PerPart<int> kColumns = {2, 4, 8, 0, 0, 0, 34, 0, 0};
constexpr std::size_t kPresent[] = {0, 1, 2, 6};

ThreadTeam& team() {
  static ThreadTeam two(2);
  return two;
}

PriorScaleValues strengths(double along, double across, double volume, double fine) {
  return {along, across, volume, 0, 0, 0, fine, 0, 0};
}

struct Problem {
  MatrixXd jacobian;  // whitened [common | modes]
  VecX data;          // whitened
  MatrixXd gram() const { return jacobian.transpose() * jacobian; }
  VecX right() const { return jacobian.transpose() * data; }
};

std::size_t part(int mode) {
  if (mode >= 14) return 6;
  if (mode >= 6) return 2;
  return mode >= 2 ? 1 : 0;
}

VecX prior_sd(const PriorScaleValues& scales) {
  VecX sd = VecX::Ones(kCommon + kModes);
  for (int i = 0; i < kModes; ++i) sd[kCommon + i] = scales[part(i)];
  return sd;
}

// A floor of `part` beside its strength.
VecX prior_sd_with(const PriorScaleValues& scales, std::size_t floored, double floor) {
  PriorScaleValues with = scales;
  with[floored] = std::hypot(scales[floored], floor);
  return prior_sd(with);
}

// Data drawn from the model whose parts have the given strengths.
Problem drawn(const PriorScaleValues& scales, std::uint64_t seed) {
  Random random(seed);
  Problem problem{MatrixXd(kData, kCommon + kModes), VecX(kData)};
  for (Eigen::Index i = 0; i < problem.jacobian.size(); ++i) {
    problem.jacobian.data()[i] = 0.3 * random.normal();
  }
  VecX truth = prior_sd(scales);
  for (double& value : truth) value *= random.normal();
  for (int i = 0; i < kData; ++i) problem.data[i] = random.normal();
  problem.data += problem.jacobian * truth;
  return problem;
}

// ln p(d | s) p(s) by the covariance of the data, up to a constant.
double log_posterior(const Problem& problem, const PriorScaleValues& scales) {
  double sum = 0.0, log_prior = 0.0;
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    sum += std::exp(-0.5 * std::pow(std::log(kStrengths[i]) / std::log(3.0), 2));
  }
  for (const std::size_t g : kPresent) {
    log_prior += scales[g] == 0.0
                     ? std::log(0.5)
                     : std::log(0.5 / sum) - 0.5 * std::pow(std::log(scales[g]) / std::log(3.0), 2);
  }
  const VecX sd = prior_sd(scales);
  MatrixXd covariance =
      problem.jacobian * sd.cwiseAbs2().asDiagonal() * problem.jacobian.transpose();
  covariance.diagonal().array() += 1.0;
  return log_prior -
         0.5 * problem.data.dot(test_support::solve_positive(covariance, problem.data).col(0)) -
         test_support::cholesky_factor(covariance).diagonal().array().log().sum();
}

PriorStrengths fitted(const Problem& problem, bool estimate = true, double broad_weight = 0.0) {
  PriorStrengths result(kColumns, kWindow, kCommon, estimate, broad_weight, team());
  EXPECT_TRUE(result.fit(problem.gram(), problem.right()));
  return result;
}

TEST(PriorStrengths, NoOtherStrengthOfOnePartIsMoreProbable) {
  const Problem problem = drawn(strengths(0.5, 0.0, 2.0, 0.25), 3);
  const PriorScaleValues best = fitted(problem).held();
  const double at_best = log_posterior(problem, best);
  EXPECT_GT(at_best, log_posterior(problem, strengths(1, 1, 1, 1)) + 5.0)
      << "the test shows nothing";
  for (const std::size_t g : kPresent) {
    for (const std::size_t h : kPresent) {
      auto other = best;
      std::swap(other[g], other[h]);
      if (best[g] == 0.0 || best[h] == 0.0) {
        EXPECT_LE(log_posterior(problem, other), at_best + 1e-3) << g << " for " << h;
      }
    }
  }
  for (const std::size_t g : kPresent) {
    for (const double strength : kStrengths) {
      auto other = best;
      other[g] = strength;
      EXPECT_LE(log_posterior(problem, other), at_best + 1e-3) << g << " at " << strength;
    }
  }
}

TEST(PriorStrengths, HypothesesAreWeighedByTheirProbability) {
  const Problem problem = drawn(strengths(0.5, 0.125, 2.0, 0.25), 3);
  const PriorStrengths result = fitted(problem);
  const auto& hypotheses = result.hypotheses();
  ASSERT_GE(hypotheses.size(), 3u);
  double sum = 0.0;
  const double at_best = log_posterior(problem, hypotheses[0].scales);
  for (const Hypothesis& each : hypotheses) {
    sum += each.weight;
    EXPECT_LE(each.weight, hypotheses[0].weight);
    const double expected = std::exp(log_posterior(problem, each.scales) - at_best);
    EXPECT_NEAR(each.weight / hypotheses[0].weight, expected, 2e-3);
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

// A part may be another one's likeness in what the data feel of it; with a single data set nobody
// can tell which of the two acts.
TEST(PriorStrengths, PartsThatExplainTheSameDataAreEquallyProbable) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Problem problem = drawn(strengths(4.0, 0.0, 0.0, 0.25), seed);
    problem.jacobian.middleCols(kCommon + 2, 2) = problem.jacobian.middleCols(kCommon, 2);
    problem.jacobian.middleCols(kCommon + 4, 2).setZero();
    const PriorStrengths result = fitted(problem);
    PriorScaleValues likeness = result.held();
    ASSERT_NE(likeness[0] > 0.0, likeness[1] > 0.0);
    std::swap(likeness[0], likeness[1]);
    double weight = 0.0;
    for (const Hypothesis& each : result.hypotheses()) {
      if (each.scales == likeness) weight = each.weight;
    }
    EXPECT_NEAR(weight, result.hypotheses()[0].weight, 1e-6) << seed;
    EXPECT_LT(std::max(result.absent()[0], result.absent()[1]), 0.6) << "one of them is needed";
  }
}

TEST(PriorStrengths, FindTheStrengthThatTheDataWereDrawnWith) {
  // 34 amplitudes are known to 1 / sqrt(2 * 34) of their standard deviation; steps are of 2.
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const double found = fitted(drawn(strengths(0.5, 0.5, 0.5, 2.0), seed)).held()[6];
    EXPECT_TRUE(found == 1.0 || found == 2.0 || found == 4.0) << found;
  }
}

TEST(PriorStrengths, APartThatTheDataDoNotNeedVanishes) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const PriorStrengths result = fitted(drawn(strengths(1.0, 1.0, 0.0, 1.0), seed));
    EXPECT_EQ(result.held()[2], 0.0) << seed;
    EXPECT_GT(result.absent()[2], 0.5) << seed;
    EXPECT_EQ(result.mean()[3], 0.0) << "the model lacks it";
  }
}

TEST(PriorStrengths, AStrengthAtItsBoundIsSaid) {
  const PriorStrengths result = fitted(drawn(strengths(1.0, 1.0, 1.0, 60.0), 4));
  EXPECT_EQ(result.held()[6], kLargestStrength);
  EXPECT_TRUE(result.at_bound()[6]);
  EXPECT_FALSE(result.at_bound()[0]);
}

TEST(PriorStrengths, DoNotDependOnEarlierData) {
  const Problem one = drawn(strengths(0.5, 0.0, 2.0, 0.25), 3);
  const Problem two = drawn(strengths(4.0, 0.5, 0.0, 1.0), 7);
  PriorStrengths used = fitted(two);
  ASSERT_TRUE(used.fit(one.gram(), one.right()));
  const PriorStrengths fresh = fitted(one);
  ASSERT_EQ(used.hypotheses().size(), fresh.hypotheses().size());
  for (std::size_t h = 0; h < fresh.hypotheses().size(); ++h) {
    EXPECT_EQ(used.hypotheses()[h].scales, fresh.hypotheses()[h].scales);
    EXPECT_EQ(used.hypotheses()[h].weight, fresh.hypotheses()[h].weight);
  }
}

// A search is asked before each of its steps, and ends where it is with hypotheses that count.
TEST(PriorStrengths, ASearchThatIsGivenUpEndsWhereItIs) {
  const Problem problem = drawn(strengths(0.5, 0.0, 2.0, 4.0), 3);
  ThreadTeam one(1);
  PriorStrengths result(kColumns, kWindow, kCommon, true, 0.0, one);
  int allowed = 0, asked = 0;
  const auto give_up = [&] { return ++asked > allowed; };
  const auto fit = [&](int steps) {
    allowed = steps;
    asked = 0;
    ASSERT_TRUE(result.fit(problem.gram(), problem.right(), {}, give_up));
    double sum = 0.0;
    for (const Hypothesis& each : result.hypotheses()) sum += each.weight;
    EXPECT_NEAR(sum, 1.0, 1e-12);
  };
  constexpr int kNoBound = 100000;
  fit(kNoBound);
  const int steps = asked;
  const PriorScaleValues end = result.held();
  ASSERT_EQ(end, fitted(problem).held());
  ASSERT_GT(steps, 6) << "the test shows nothing";
  fit(0);
  EXPECT_LE(asked, 3);  // by two ascents, and before what would follow them
  EXPECT_NE(result.held(), end);
  fit(steps);
  EXPECT_EQ(result.held(), end);

  const Problem other = drawn(strengths(4.0, 0.5, 0.0, 0.125), 7);
  const PriorScaleValues held = result.held();
  asked = allowed = 0;
  ASSERT_EQ(result.refit(other.gram(), other.right(), true, {}, give_up), true);
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(result.held(), held);
}

// By the formulas of each hypothesis, with dense inverses.
void expect_moments_of_the_mixture(const Problem& problem, PriorStrengths result,
                                   std::size_t floored = 0, double floor = 0.0) {
  const int size = kCommon + kModes;
  VecX mean = VecX::Zero(size), most_probable;
  MatrixXd second = MatrixXd::Zero(size, size);
  for (const Hypothesis& each : result.hypotheses()) {
    const VecX sd = prior_sd_with(each.scales, floored, floor);
    MatrixXd inner = sd.asDiagonal() * problem.gram() * sd.asDiagonal();
    inner.diagonal().array() += 1.0;
    const MatrixXd covariance = sd.asDiagonal() * test_support::inverse(inner) * sd.asDiagonal();
    const VecX m = covariance * problem.right();
    if (most_probable.size() == 0) most_probable = m;
    mean += each.weight * m;
    second += each.weight * (covariance + m * m.transpose());
  }
  const MatrixXd covariance = second - mean * mean.transpose();
  VecX found(size);
  MatrixXd factor(kModes, kModes);
  ASSERT_TRUE(result.mean_shift(found));
  ASSERT_TRUE(result.covariance(factor));
  EXPECT_LT((found - (mean - most_probable)).norm(), 1e-4 * mean.norm());
  const MatrixXd lower = factor.triangularView<Eigen::Lower>();
  EXPECT_LT((lower * lower.transpose() - covariance.bottomRightCorner(kModes, kModes)).norm(),
            1e-4 * covariance.norm());
}

// A hypothesis that was found for one linear model stays for another that hardly prefers a
// different one, and gives way to one that is more probable by kWorthwhile.
TEST(PriorStrengths, AnotherLinearModelChangesThemOnlyWhereItIsWorthwhile) {
  int stayed = 0, gave_way = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Problem one = drawn(strengths(0.5, 0.125, 2.0, 0.25), seed);
    const Problem two = drawn(strengths(0.5, 0.5, 0.0, 0.25), seed + 100);
    PriorStrengths result = fitted(one);
    const PriorScaleValues held = result.held();
    ASSERT_EQ(result.refit(one.gram(), one.right(), true), false);
    EXPECT_EQ(result.held(), held);
    ASSERT_EQ(result.refit(two.gram(), two.right(), false), false);
    EXPECT_EQ(result.held(), held) << "loads that nobody descends from again are its own";
    const auto refitted = value_or_fail(result.refit(two.gram(), two.right(), true));
    const bool changed = refitted;
    double gain = 0.0;  // of another strength of one part
    for (const std::size_t g : kPresent) {
      for (const double strength : kStrengths) {
        PriorScaleValues other = held;
        other[g] = strength;
        gain = std::max(gain, log_posterior(two, other) - log_posterior(two, held));
      }
    }
    EXPECT_EQ(changed, gain > kWorthwhile) << gain;
    EXPECT_EQ(result.held(), changed ? fitted(two).held() : held);
    (changed ? gave_way : stayed) += 1;
  }
  EXPECT_GT(gave_way, 0) << "the test shows nothing";
  const Problem one = drawn(strengths(0.5, 0.125, 2.0, 0.25), 3);
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {  // the same surgery, measured a little worse
    Problem again = one;
    Random random(seed);
    for (double& value : again.data) value += 0.7 * random.normal();
    PriorStrengths result = fitted(one);
    const auto changed = value_or_fail(result.refit(again.gram(), again.right(), true));
    stayed += !changed && fitted(again).held() != result.held() ? 1 : 0;
  }
  EXPECT_GT(stayed, 0) << "the test shows nothing";
}

TEST(PriorStrengths, MomentsAreThoseOfTheMixture) {
  const Problem problem = drawn(strengths(0.5, 0.125, 2.0, 0.25), 3);
  const PriorStrengths result = fitted(problem);
  ASSERT_GE(result.hypotheses().size(), 3u) << "the test shows nothing";
  expect_moments_of_the_mixture(problem, result);
}

TEST(PriorStrengths, AFloorIsVarianceThatNoHypothesisTakesAway) {
  const Problem problem = drawn(strengths(0.5, 0.0, 2.0, 0.0), 5);
  PriorStrengths result(kColumns, kWindow, kCommon, true, 0.0, team());
  result.set_floor(static_cast<PriorPart>(6), 0.4);
  ASSERT_TRUE(result.fit(problem.gram(), problem.right()));
  EXPECT_EQ(result.held()[6], 0.0) << "the test shows nothing";
  EXPECT_EQ(result.scale_of(kModes - 1), 0.4);
  EXPECT_GE(result.mean_square()[6], 0.16);
  expect_moments_of_the_mixture(problem, result, 6, 0.4);
  PriorStrengths fixed(kColumns, kWindow, kCommon, false, 0.0, team());
  fixed.set_floor(static_cast<PriorPart>(6), 0.4);
  EXPECT_EQ(fixed.scale_of(kModes - 1), 1.0) << "without effect where strengths are given";
}

TEST(PriorStrengths, StrengthsThatAreNotEstimatedStayAsInTheCase) {
  const Problem problem = drawn(strengths(0.5, 0.0, 2.0, 0.25), 3);
  const PriorStrengths result = fitted(problem, false);
  ASSERT_EQ(result.hypotheses().size(), 1u);
  EXPECT_EQ(result.held(), strengths(1, 1, 1, 1));
  expect_moments_of_the_mixture(problem, result);
}

// Before the data, of a part that is there.
double root_mean_square_of_strength() {
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    const double p = std::exp(-0.5 * std::pow(std::log(kStrengths[i]) / std::log(3.0), 2));
    sum += p;
    squares += p * kStrengths[i] * kStrengths[i];
  }
  return std::sqrt(squares / sum);
}

TEST(PriorStrengths, TheBroadHypothesisKeepsItsWeightWhateverTheDataSay) {
  const double usual = root_mean_square_of_strength();
  for (const auto& truth : {strengths(0.5, 0.0, 2.0, 0.0), strengths(0.0, 0.0, 0.0, 8.0)}) {
    const Problem problem = drawn(truth, 5);
    const PriorStrengths result = fitted(problem, true, 0.1), without = fitted(problem);
    EXPECT_EQ(result.held(), without.held()) << "no search touches it";
    const Hypothesis& broad = result.hypotheses().back();
    EXPECT_DOUBLE_EQ(broad.weight, 0.1);
    ASSERT_EQ(result.hypotheses().size(), without.hypotheses().size() + 1);
    for (const std::size_t g : kPresent) {
      EXPECT_DOUBLE_EQ(broad.scales[g], std::max(usual, result.held()[g]));
    }
    for (std::size_t h = 0; h < without.hypotheses().size(); ++h) {
      EXPECT_NEAR(result.hypotheses()[h].weight, 0.9 * without.hypotheses()[h].weight, 1e-12);
    }
    expect_moments_of_the_mixture(problem, result);
  }
}

// Data of which the far part explains nothing leave it as strong as it was.
TEST(PriorStrengths, NoDataChooseTheStrengthOfTheFarPart) {
  constexpr auto kFar = static_cast<std::size_t>(PriorPart::kFar);
  const Problem problem = drawn(strengths(0.5, 0.0, 2.0, 0.0), 5);
  PerPart<int> columns = kColumns;
  columns[6] = 30;
  columns[kFar] = 4;
  PriorStrengths result(columns, kWindow, kCommon, true, 0.0, team());
  ASSERT_TRUE(result.fit(problem.gram(), problem.right()));
  for (const Hypothesis& each : result.hypotheses()) {
    EXPECT_DOUBLE_EQ(each.scales[kFar], root_mean_square_of_strength());
  }
}

// What the data took away of the broad hypothesis's variance: S^2 - X^T X is its covariance.
TEST(PriorStrengths, WhatIsExplainedBroadlyIsWhatTheDataTookAway) {
  const Problem problem = drawn(strengths(0.5, 0.125, 2.0, 0.25), 3);
  PriorStrengths result = fitted(problem, true, 0.1);
  linalg::GrowingMatrix x;
  VecX variances;
  ASSERT_TRUE(result.explained_broadly(x, variances));
  const VecX sd = prior_sd(result.hypotheses().back().scales);
  MatrixXd inner = sd.asDiagonal() * problem.gram() * sd.asDiagonal();
  inner.diagonal().array() += 1.0;
  const MatrixXd covariance = sd.asDiagonal() * test_support::inverse(inner) * sd.asDiagonal();
  MatrixXd found = -x.transpose() * x;
  found.diagonal() += variances;
  EXPECT_LT((found - covariance.bottomRightCorner(kModes, kModes)).norm(),
            1e-4 * covariance.norm());
}

// Points on a line of 40 mm: a smooth load moves them, and their outline is off by a smooth error
// of another length. Columns of the error: a full factor of its covariance for 5 mm, with the
// variances that make the other hypotheses of it (registration/outline_errors.hpp does this for any
// points).
struct Outline {
  static constexpr int kPoints = 120, kErrors = 24;
  Outline() : columns(kPoints, kErrors), variance(kErrors, kOutlineErrors.size()) {
    // Cosines along the line are nearly the eigenvectors of every such covariance.
    constexpr double kLength_mm = 40.0;
    for (int k = 0; k < kErrors; ++k) {
      const double wave = M_PI * k / kLength_mm;
      const auto spectrum = [&](double length_mm) {
        return (k == 0 ? 1.0 : 2.0) * std::sqrt(2.0 * M_PI) * length_mm / (2.0 * kLength_mm) *
               std::exp(-0.5 * std::pow(wave * length_mm, 2));
      };
      const double most = std::max(spectrum(5.0), spectrum(10.0));
      for (int i = 0; i < kPoints; ++i) {
        columns(i, k) = 0.5 * std::sqrt(most) * std::cos(wave * kLength_mm * (i + 0.5) / kPoints);
      }
      for (std::size_t e = 0; e < kOutlineErrors.size(); ++e) {
        variance(k, static_cast<Eigen::Index>(e)) = std::pow(kOutlineErrors[e].sd_mm / 0.5, 2) *
                                                    spectrum(kOutlineErrors[e].length_mm) / most;
      }
    }
  }
  // Data of noise `sd_mm` and an error of hypothesis `e`; loads: a swelling of 8 modes, smooth over
  // a third of the line, part 2. Whitened by sd_mm.
  Problem drawn(int e, double swelling_mm, std::uint64_t seed) const {
    constexpr double kSd_mm = 0.2;
    Random random(seed);
    MatrixXd loads = MatrixXd::Zero(kPoints, kModes);
    for (int k = 0; k < 8; ++k) {
      for (int i = 0; i < kPoints; ++i) {
        loads(i, 6 + k) = std::exp(-0.5 * std::pow((40.0 * i / kPoints - 5.0 * k) / 6.0, 2));
      }
    }
    VecX truth(kErrors), amplitudes(8);
    for (double& value : truth) value = random.normal();
    for (double& value : amplitudes) value = swelling_mm * random.normal();
    VecX data = columns * (variance.col(e).cwiseSqrt().asDiagonal() * truth) +
                loads.middleCols(6, 8) * amplitudes;
    for (double& value : data) value += kSd_mm * random.normal();
    Problem problem{MatrixXd(kPoints, kErrors + kModes), data / kSd_mm};
    problem.jacobian << columns / kSd_mm, loads / kSd_mm;
    return problem;
  }
  MatrixXd columns, variance;
};

PriorStrengths fitted_with_errors(const Problem& problem, const MatrixXd& variance) {
  PriorStrengths result(kColumns, kWindow, Outline::kErrors, true, 0.0, team());
  EXPECT_TRUE(result.fit(problem.gram(), problem.right(), variance));
  return result;
}

// An outline that is off by half a millimetre over ten looks like swelling to errors that are
// independent, and not to errors that neighbours share.
TEST(PriorStrengths, AnOutlineThatIsOffIsNoSwelling) {
  const Outline outline;
  int independent = 0, shared = 0, missed = 0;
  constexpr int kDraws = 20;
  const auto evidence_of_swelling = [](const PriorStrengths& fit) {
    const double absent = fit.absent()[2];
    return std::log(std::max(1e-9, 1.0 - absent) / std::max(1e-9, absent)) > 1.0;
  };
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const Problem off = outline.drawn(6, 0.0, seed);
    Problem alone = off;
    alone.jacobian.leftCols(Outline::kErrors).setZero();
    independent += evidence_of_swelling(fitted_with_errors(alone, outline.variance));
    shared += evidence_of_swelling(fitted_with_errors(off, outline.variance));
    missed +=
        !evidence_of_swelling(fitted_with_errors(outline.drawn(0, 3.0, seed), outline.variance));
  }
  EXPECT_GT(independent, kDraws * 9 / 10) << "the test shows nothing";
  EXPECT_LE(shared, kDraws / 10);
  EXPECT_LE(missed, kDraws / 20) << "of swellings that are there";
}

TEST(PriorStrengths, ErrorHypothesesAreWeighedByTheirProbability) {
  const Outline outline;
  const Problem problem = outline.drawn(2, 1.0, 5);
  const PriorStrengths result = fitted_with_errors(problem, outline.variance);
  const auto log_p = [&](const Hypothesis& each) {
    Problem scaled = problem;
    MatrixXd covariance = MatrixXd::Identity(Outline::kPoints, Outline::kPoints);
    const auto errors = problem.jacobian.leftCols(Outline::kErrors);
    covariance += errors * outline.variance.col(each.error).asDiagonal() * errors.transpose();
    const auto loads = problem.jacobian.rightCols(kModes);
    covariance +=
        loads * prior_sd(each.scales).tail(kModes).cwiseAbs2().asDiagonal() * loads.transpose();
    double log_prior = std::log(
        each.error == 0 ? kNoOutlineError
                        : (1.0 - kNoOutlineError) / static_cast<double>(kOutlineErrors.size() - 1));
    double sum = 0.0;
    for (std::size_t i = 1; i < kStrengths.size(); ++i) {
      sum += std::exp(-0.5 * std::pow(std::log(kStrengths[i]) / std::log(3.0), 2));
    }
    for (const std::size_t g : kPresent) {
      const double s = each.scales[g];
      log_prior += s == 0.0 ? std::log(0.5)
                            : std::log(0.5 / sum) - 0.5 * std::pow(std::log(s) / std::log(3.0), 2);
    }
    return log_prior -
           0.5 * problem.data.dot(test_support::solve_positive(covariance, problem.data).col(0)) -
           test_support::cholesky_factor(covariance).diagonal().array().log().sum();
  };
  const auto& hypotheses = result.hypotheses();
  ASSERT_GE(hypotheses.size(), 5u);
  std::set<int> errors;
  for (const Hypothesis& each : hypotheses) {
    errors.insert(each.error);
    EXPECT_NEAR(each.weight / hypotheses[0].weight, std::exp(log_p(each) - log_p(hypotheses[0])),
                0.02);
  }
  EXPECT_GE(errors.size(), 2u);
  for (int e = 0; e < static_cast<int>(kOutlineErrors.size()); ++e) {  // no single change is better
    EXPECT_LE(log_p({hypotheses[0].scales, 1.0, e}), log_p(hypotheses[0]) + 1e-2) << e;
  }
}

TEST(PriorStrengths, NumbersThatAreNotFiniteAreRejected) {
  Problem problem = drawn(strengths(1, 1, 1, 1), 3);
  PriorStrengths result(kColumns, kWindow, kCommon, true, 0.0, team());
  MatrixXd gram = problem.gram();
  gram(5, 5) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(result.fit(gram, problem.right()).error().code, ErrorCode::kNotFinite);
  VecX right = problem.right();
  right[7] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(result.fit(problem.gram(), right).error().code, ErrorCode::kNotFinite);
}

TEST(PriorStrengths, AWindowLeavesTheFirstModesOut) {
  const Problem problem = drawn(strengths(0.5, 0.5, 2.0, 0.25), 3);
  const int left = 6;  // both gravity parts
  const int size = kCommon + kModes - left;
  MatrixXd jacobian(kData, size);
  jacobian << problem.jacobian.leftCols(kCommon), problem.jacobian.rightCols(size - kCommon);
  PriorStrengths result(kColumns, {left, kModes - left}, kCommon, true, 0.0, team());
  ASSERT_TRUE(result.fit(jacobian.transpose() * jacobian, jacobian.transpose() * problem.data));
  EXPECT_EQ(result.held()[0], 0.0);
  EXPECT_EQ(result.held()[1], 0.0);
  EXPECT_EQ(result.scale_of(0), result.held()[2]);
  EXPECT_GT(result.held()[2], 0.0);
}

}  // namespace
}  // namespace brainshift::inversion
