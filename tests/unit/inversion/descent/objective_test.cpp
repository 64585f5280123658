// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/objective.hpp"

#include <cmath>
#include <limits>

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
  const auto misfit = Misfit::build(model, data);
  ASSERT_TRUE(misfit.has_value());
  std::srand(5);
  const Points u = Points::Random(3, patient()->mesh.num_nodes());
  const Points r = Points::Random(3, data.size());
  const double left = misfit->inner(r, misfit->sample(u));
  ASSERT_GT(std::abs(left), 1.0);
  EXPECT_NEAR(left, inner(misfit->adjoint(r), u), 1e-12 * std::abs(left));
}

TEST(Misfit, WeighsEveryDatumByItsStandardDeviation) {
  const PreparedModel model = prepare(Boundary::kFixed);
  const SparseData data = uneven_data(model);
  const auto misfit = Misfit::build(model, data);
  ASSERT_TRUE(misfit.has_value());
  const Points e = misfit->residual(Points::Zero(3, patient()->mesh.num_nodes()));
  double expected = 0.0;
  for (int i = 0; i < data.size(); ++i) {
    expected += data.displacements.col(i).squaredNorm() / (data.sd_mm[i] * data.sd_mm[i]);
  }
  EXPECT_NEAR(misfit->inner(e, e), expected, 1e-12 * expected);
}

// Omega is quadratic for a given set: it must be higher on either side of the exact step, by the
// same amount.
TEST(LineSearch, StepsToTheMinimumOfTheObjective) {
  const PreparedModel model = prepare(Boundary::kContact);
  const SparseData data = uneven_data(model);
  const auto misfit = Misfit::build(model, data);
  ASSERT_TRUE(misfit.has_value());
  const contact::ActiveSet none(some_active(model).size(), 0);
  std::srand(7);
  const Points w = 10.0 * Points::Random(3, patient()->mesh.num_nodes());
  const Points dw = 10.0 * Points::Random(3, patient()->mesh.num_nodes());
  const Points b = model.prior().apply(w);
  const Points s = model.prior().apply(dw);
  const Points e = misfit->residual(model.forward().solve(b));
  const auto alpha = exact_step(*misfit, e, misfit->sample(model.forward().solve(s)), b, s, dw);
  ASSERT_TRUE(alpha.has_value());
  ASSERT_GT(std::abs(*alpha), 1e-3);
  const auto omega = [&](double step) {
    return evaluate_objective(model, data, w + step * dw, none)->value;
  };
  const double least = omega(*alpha);
  const double above = omega(*alpha + 1.0) - least;
  const double below = omega(*alpha - 1.0) - least;
  ASSERT_GT(above, 1e-6 * least);
  EXPECT_NEAR(above, below, 1e-6 * above);
}

TEST(LineSearch, StandsStillWhereTheDirectionIsZeroAndRefusesNaN) {
  const PreparedModel model = prepare(Boundary::kFixed);
  const SparseData data = uneven_data(model);
  const auto misfit = Misfit::build(model, data);
  ASSERT_TRUE(misfit.has_value());
  const Points zero = Points::Zero(3, patient()->mesh.num_nodes());
  const Points no_data = Points::Zero(3, data.size());
  const auto still = exact_step(*misfit, data.displacements, no_data, zero, zero, zero);
  ASSERT_TRUE(still.has_value());
  EXPECT_EQ(*still, 0.0);
  Points bad = no_data;
  bad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const auto refused = exact_step(*misfit, data.displacements, bad, zero, zero, zero);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kNotFinite);
}

}  // namespace
}  // namespace brainshift::inversion
