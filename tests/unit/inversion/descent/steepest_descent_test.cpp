// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/steepest_descent.hpp"

#include <gtest/gtest.h>

#include "common/inversion/invert.hpp"
#include "tests/unit/inversion/objective.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

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
  const auto at = evaluate_objective(model, data, w, active);
  ASSERT_TRUE(at.has_value()) << at.error().message;
  const double slope = at->gradient.cwiseProduct(db).sum();
  const double h = 0.5;
  const auto forward = evaluate_objective(model, data, w + h * dw, active);
  const auto backward = evaluate_objective(model, data, w - h * dw, active);
  const double difference = (forward->value - backward->value) / (2 * h);
  ASSERT_GT(std::abs(slope), 1e-3 * at->value);
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
  const auto estimate = invert(model, data, Method::kPaper);
  ASSERT_TRUE(estimate.has_value()) << estimate.error().message;
  EXPECT_EQ(estimate->status, EstimateStatus::kConverged);
  ASSERT_GT(expected.cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((flat(estimate->displacement) - expected).cwiseAbs().maxCoeff(),
            0.01 * expected.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace brainshift::inversion
