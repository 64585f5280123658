// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/contact/penalised_system.hpp"
#include "common/inversion/descent/descents.hpp"
#include "common/inversion/descent/objective.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/objective.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

SparseData uneven_data(const PreparedModel& model) {
  SparseData data = sagging_data(model, 0.3);
  for (int i = 0; i < data.size(); ++i) data.sd_mm[i] = 0.1 + 0.05 * (i % 7);
  return data;
}

// r . W_e A u = A^T W_e r . u
TEST(Misfit, AdjointIsTheTransposeOfSampling) {
  const PreparedModel model = prepare(Boundary::kFixed);
  const SparseData data = uneven_data(model);
  const auto misfit = value_or_fail(Misfit::build(model, data));
  std::srand(5);
  const Points u = Points::Random(3, patient()->mesh.num_nodes());
  const Points r = Points::Random(3, data.size());
  const double left = misfit.inner(r, misfit.sample(u));
  ASSERT_GT(std::abs(left), 1.0);
  EXPECT_NEAR(left, inner(misfit.adjoint(r), u), 1e-12 * std::abs(left));
}

TEST(Misfit, WeighsEveryDatumByItsStandardDeviation) {
  const PreparedModel model = prepare(Boundary::kFixed);
  const SparseData data = uneven_data(model);
  const auto misfit = value_or_fail(Misfit::build(model, data));
  const Points e = misfit.residual(Points::Zero(3, patient()->mesh.num_nodes()));
  double expected = 0.0;
  for (int i = 0; i < data.size(); ++i) {
    expected += data.displacements.col(i).squaredNorm() / (data.sd_mm[i] * data.sd_mm[i]);
  }
  EXPECT_NEAR(misfit.inner(e, e), expected, 1e-12 * expected);
}

// Omega is quadratic for a given set: it must be higher on either side of the exact step, by the
// same amount.
TEST(LineSearch, StepsToTheMinimumOfTheObjective) {
  const PreparedModel model = prepare(Boundary::kContact);
  const SparseData data = uneven_data(model);
  const auto misfit = value_or_fail(Misfit::build(model, data));
  const contact::ActiveSet none(some_active(model).size(), 0);
  std::srand(7);
  const Points w = 10.0 * Points::Random(3, patient()->mesh.num_nodes());
  const Points dw = 10.0 * Points::Random(3, patient()->mesh.num_nodes());
  const Points b = model.prior().apply(w);
  const Points s = model.prior().apply(dw);
  const Points e = misfit.residual(model.forward().solve(b));
  const auto alpha =
      value_or_fail(exact_step(misfit, e, misfit.sample(model.forward().solve(s)), b, s, dw));
  ASSERT_GT(std::abs(alpha), 1e-3);
  const auto omega = [&](double step) {
    return evaluate_objective(model, data, w + step * dw, none)->value;
  };
  const double least = omega(alpha);
  const double above = omega(alpha + 1.0) - least;
  const double below = omega(alpha - 1.0) - least;
  ASSERT_GT(above, 1e-6 * least);
  EXPECT_NEAR(above, below, 1e-6 * above);
}

TEST(LineSearch, StandsStillWhereTheDirectionIsZeroAndRefusesNaN) {
  const PreparedModel model = prepare(Boundary::kFixed);
  const SparseData data = uneven_data(model);
  const auto misfit = value_or_fail(Misfit::build(model, data));
  const Points zero = Points::Zero(3, patient()->mesh.num_nodes());
  const Points no_data = Points::Zero(3, data.size());
  const auto still =
      value_or_fail(exact_step(misfit, data.displacements, no_data, zero, zero, zero));
  EXPECT_EQ(still, 0.0);
  Points bad = no_data;
  bad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  refusal_of(exact_step(misfit, data.displacements, bad, zero, zero, zero), ErrorCode::kNotFinite);
}

// What every descent method owes its caller: history, iterates, status, reason, a stop when asked.

class DescentMethods : public ::testing::TestWithParam<Method> {
 protected:
  static Result<Estimate> run(const PreparedModel& model, const SparseData& data,
                              const InversionOptions& options = {}) {
    return invert(model, data, GetParam(), options);
  }
};

INSTANTIATE_TEST_SUITE_P(Methods, DescentMethods,
                         ::testing::Values(Method::kPaper, Method::kPaperWoodbury,
                                           Method::kIterativeSolver),
                         [](const auto& each) {
                           std::string name(to_string(each.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(DescentMethods, PublishEveryIterateAndConverge) {
  const PreparedModel model = prepare(Boundary::kContact);
  InversionOptions options;
  std::size_t iterates = 0;
  options.on_iterate = [&](const Estimate& iterate) {
    ++iterates;
    EXPECT_EQ(iterate.status, EstimateStatus::kIterating);
    EXPECT_EQ(iterate.history.size(), iterates);
    EXPECT_EQ(iterate.history.back().iteration, static_cast<int>(iterates));
  };
  const auto estimate = value_or_fail(run(model, sagging_data(model, 0.1), options));
  EXPECT_EQ(estimate.history.size(), iterates);
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  EXPECT_NE(estimate.reason.find("misfit changed by less than 0.001"), std::string::npos)
      << estimate.reason;
  EXPECT_NEAR(estimate.history.front().misfit_mm.mean, estimate.initial_misfit_mm.mean, 1e-12);
  EXPECT_LT(estimate.misfit_mm.mean, 0.2 * estimate.initial_misfit_mm.mean);
  EXPECT_EQ(estimate.active_slaves.size(),
            static_cast<std::size_t>(estimate.contact_force_n.size()));
}

TEST_P(DescentMethods, KeepTheLastIterateAtTheIterationLimit) {
  CaseConfig config = test_support::toy_config();
  config.inversion.max_iterations = 2;
  const PreparedModel model = prepare(Boundary::kContact, config);
  const auto estimate = value_or_fail(run(model, sagging_data(model, 0.1)));
  EXPECT_EQ(estimate.status, EstimateStatus::kIterationLimit);
  EXPECT_EQ(estimate.history.size(), 2u);
  EXPECT_GT(estimate.displacement.norm(), 0.0);
  EXPECT_NE(estimate.reason.find("limit 2"), std::string::npos) << estimate.reason;
}

TEST_P(DescentMethods, StopWhenAsked) {
  const PreparedModel model = prepare(Boundary::kContact);
  std::stop_source source;
  InversionOptions options;
  options.stop = source.get_token();
  options.on_iterate = [&](const Estimate& iterate) {
    if (iterate.history.size() == 2) source.request_stop();
  };
  EXPECT_THAT(refusal_of(run(model, sagging_data(model, 0.1), options), ErrorCode::kNotConverged),
              testing::HasSubstr("iteration 3"));
}

TEST_P(DescentMethods, AreAtTheMinimumWhenNothingMoved) {
  const PreparedModel model = prepare(Boundary::kContact);
  SparseData data = sagging_data(model, 0.0);
  data.displacements.setZero();
  const auto estimate = value_or_fail(run(model, data));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  EXPECT_NE(estimate.reason.find("gradient is zero"), std::string::npos) << estimate.reason;
  EXPECT_EQ(estimate.displacement.norm(), 0.0);
}

using contact::ActiveSet;

class Inversion : public ::testing::TestWithParam<Boundary> {};

INSTANTIATE_TEST_SUITE_P(Boundaries, Inversion,
                         ::testing::Values(Boundary::kContact, Boundary::kFixed),
                         [](const auto& each) { return std::string(to_string(each.param)); });

// <K_p^-1 f, g> = <f, K_p^-1 g>: the adjoint of the forward model is the forward model.
TEST_P(Inversion, ForwardSolveIsSelfAdjoint) {
  const PreparedModel model = prepare(GetParam());
  std::srand(2);
  const Points f = Points::Random(3, patient()->mesh.num_nodes());
  const Points g = Points::Random(3, patient()->mesh.num_nodes());
  const double left = model.forward().solve(f).cwiseProduct(g).sum();
  const double right = f.cwiseProduct(model.forward().solve(g)).sum();
  ASSERT_GT(std::abs(left), 1.0);
  EXPECT_NEAR(left, right, 1e-11 * std::abs(left));
}

// gradient . direction against central differences of Omega(b), b = Sigma w. Omega is quadratic for
// a given active set, so central differences are exact up to rounding.
TEST_P(Inversion, GradientEqualsFiniteDifferences) {
  const PreparedModel model = prepare(GetParam());
  const SparseData data = sagging_data(model, 0.3);
  const ActiveSet active = some_active(model);
  std::srand(6);
  const double scale = 1e2;
  const Points w = scale * Points::Random(3, patient()->mesh.num_nodes());
  const Points dw = scale * Points::Random(3, patient()->mesh.num_nodes());
  const Points db = model.prior().apply(dw);
  const auto at = value_or_fail(evaluate_objective(model, data, w, active));
  const double slope = at.gradient.cwiseProduct(db).sum();
  const double h = 0.5;
  const auto forward = evaluate_objective(model, data, w + h * dw, active);
  const auto backward = evaluate_objective(model, data, w - h * dw, active);
  const double difference = (forward->value - backward->value) / (2 * h);
  ASSERT_GT(std::abs(slope), 1e-3 * at.value);
  EXPECT_NEAR(difference, slope, 1e-7 * std::abs(slope));
}

TEST_F(Inversion, ContactForcesOfTheGradientDependOnTheActiveSet) {
  const PreparedModel model = prepare(Boundary::kContact);
  const SparseData data = sagging_data(model, 0.3);
  const Points w = Points::Zero(3, patient()->mesh.num_nodes());
  const ActiveSet none(some_active(model).size(), 0);
  const auto open = evaluate_objective(model, data, w, none);
  const auto closed = evaluate_objective(model, data, w, some_active(model));
  EXPECT_GT((open->gradient - closed->gradient).norm(), 1e-3 * open->gradient.norm());
}

// Independent reference: with the fixed boundary the minimiser is linear in the data. Steepest
// descent with a tiny stop tolerance must approach it.
TEST_F(Inversion, ApproachesTheDensePosteriorMean) {
  CaseConfig config = test_support::toy_config();
  config.inversion.relative_misfit_change = 1e-9;
  config.inversion.max_iterations = 4000;
  const PreparedModel model = prepare(Boundary::kFixed, config);
  SparseData data = sagging_data(model, 0.1);
  data.sd_mm.setConstant(1.0);  // keeps the condition of steepest descent moderate

  const VecX expected = dense_posterior_mean(model, data);
  const auto estimate = value_or_fail(invert(model, data, Method::kPaper));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  ASSERT_GT(expected.cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((flat(estimate.displacement) - expected).cwiseAbs().maxCoeff(),
            0.01 * expected.cwiseAbs().maxCoeff());
}

// With direct solves; method pcg has an iterative system in their place.
Result<Estimate> run(const PreparedModel& model, const SparseData& data,
                     const InversionOptions& options = {}) {
  contact::WoodburySystem system(model.forward());
  return conjugate_gradients(model, data, options, system);
}

CaseConfig tight_config(int max_iterations) {
  CaseConfig config = test_support::toy_config();
  config.inversion.relative_misfit_change = 1e-10;
  config.inversion.max_iterations = max_iterations;
  return config;
}

TEST(ConjugateGradients, ReachTheDensePosteriorMeanWhereNoContactIs) {
  const PreparedModel model = prepare(Boundary::kFixed, tight_config(1000));
  const SparseData data = sagging_data(model, 0.1);
  const VecX expected = dense_posterior_mean(model, data);
  const auto estimate = value_or_fail(run(model, data));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  ASSERT_GT(expected.cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((flat(estimate.displacement) - expected).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(ConjugateGradients, NeedFewerIterationsThanSteepestDescentForTheSameError) {
  const PreparedModel model = prepare(Boundary::kFixed, tight_config(1000));
  SparseData data = sagging_data(model, 0.1);
  const VecX expected = dense_posterior_mean(model, data);
  const auto iterations_to = [&](double error_mm, bool conjugate) {
    int needed = 0;
    std::stop_source source;
    InversionOptions options;
    options.stop = source.get_token();
    options.on_iterate = [&](const Estimate& iterate) {
      if ((flat(iterate.displacement) - expected).cwiseAbs().maxCoeff() > error_mm) return;
      if (needed == 0) needed = static_cast<int>(iterate.history.size());
      source.request_stop();
    };
    if (conjugate) {
      (void)run(model, data, options);
    } else {
      (void)invert(model, data, Method::kPaperWoodbury, options);
    }
    return needed == 0 ? 1000 : needed;
  };
  const int conjugate = iterations_to(0.05, true);
  const int steepest = iterations_to(0.05, false);
  EXPECT_LT(2 * conjugate, steepest);
  RecordProperty("conjugate", conjugate);
  RecordProperty("steepest", steepest);
}

// With contact no dense formula exists, but a minimum for the last active set satisfies w = W_b b =
// lambda / 2: the forcing that the misfit of the estimate implies must give the estimate back.
// Other code evaluates it.
TEST(ConjugateGradients, EndAtAFixedPointOfTheirLastActiveSet) {
  const PreparedModel model = prepare(Boundary::kContact, tight_config(400));
  SparseData data = sagging_data(model, 0.1);
  data.sd_mm.setConstant(
      5.0);  // a weak pull of the data, so that the fixed point is well conditioned
  const auto estimate = value_or_fail(run(model, data));
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged) << estimate.reason;
  const auto& pairs = model.forward().contact().pairs();
  contact::ActiveSet active(pairs.size(), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto& slaves = estimate.active_slaves;
    active[i] = std::find(slaves.begin(), slaves.end(), pairs[i].slave) != slaves.end();
  }
  ASSERT_GT(contact::count(active), 0);
  contact::RefactorisedSystem system(model.forward());
  ASSERT_TRUE(system.activate(active).has_value());
  const auto misfit = value_or_fail(Misfit::build(model, data));
  Points w;
  ASSERT_TRUE(system.solve(misfit.adjoint(misfit.residual(estimate.displacement)), w).has_value());
  Points u;
  ASSERT_TRUE(system.solve_with_gaps(model.prior().apply(w), u).has_value());
  ASSERT_GT(u.cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((u - estimate.displacement).cwiseAbs().maxCoeff(), 1e-3);
}

// Where both settle, contact included; the paper's own stop rule ends steepest descent long before
// on stiff data.
TEST(ConjugateGradients, MeetSteepestDescentAtTheSameMinimumWithContact) {
  const PreparedModel model = prepare(Boundary::kContact, tight_config(2000));
  SparseData data = sagging_data(model, 0.1);
  data.sd_mm.setConstant(5.0);
  const auto conjugate = run(model, data);
  const auto steepest = invert(model, data, Method::kPaperWoodbury);
  ASSERT_TRUE(conjugate.has_value() && steepest.has_value());
  EXPECT_EQ(steepest->status, EstimateStatus::kConverged) << steepest->reason;
  EXPECT_GT(conjugate->contact.active, 0);
  EXPECT_EQ(conjugate->active_slaves, steepest->active_slaves);
  EXPECT_LT((conjugate->displacement - steepest->displacement).colwise().norm().maxCoeff(), 1e-3);
  EXPECT_LT(conjugate->history.size(), steepest->history.size());
}

}  // namespace
}  // namespace brainshift::inversion
