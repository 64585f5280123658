// SPDX-License-Identifier: GPL-3.0-or-later
// Identities that the inversion rests on, with contact active and with pore pressure carried:
//   <K_p^-1 f, g> = <f, K_p^-1 g>             the forward model is self-adjoint
//   d/dh Omega(Sigma (w + h dw)) = gradient . Sigma dw               paper eq. 5-8
// For a given active set Omega is quadratic, so central differences are exact but for rounding.
#include <gtest/gtest.h>

#include <cmath>

#include "common/contact/penalised_system.hpp"
#include "tests/support/study_record.hpp"
#include "tests/unit/inversion/objective.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

using test_support::record_check;
constexpr const char* kAdjointStudy = "adjoint";
constexpr const char* kAdjointSource = "Ji et al. 2009 eq. 5-8";

struct Physics {
  const char* name;
  Carry pressure;
};
class Adjoint : public ::testing::TestWithParam<Physics> {
 protected:
  static PreparedModel model() {
    CaseConfig config = test_support::toy_config();
    config.scene.pressure = GetParam().pressure;
    config.scene.pressure_step_s = 0.3;  // about the toy patient's consolidation time
    return prepare(Boundary::kContact, config);
  }
  static Points random_points(unsigned seed) {
    std::srand(seed);
    return Points::Random(3, patient()->mesh.num_nodes());
  }
};
INSTANTIATE_TEST_SUITE_P(Physics, Adjoint,
                         ::testing::Values(Physics{"drained", Carry::kAuto},
                                           Physics{"pressure", Carry::kOn}),
                         [](const auto& each) { return std::string(each.param.name); });

TEST_P(Adjoint, OfThePenalisedSystemIsItself) {
  const PreparedModel prepared = model();
  ASSERT_EQ(prepared.forward().factor().drained() == nullptr, GetParam().pressure == Carry::kOn);
  contact::RefactorisedSystem refactorised(prepared.forward());
  contact::WoodburySystem woodbury(prepared.forward());
  const Points f = random_points(2), g = random_points(3);
  contact::PenalisedSystem* const systems[] = {&refactorised, &woodbury};
  const char* const names[] = {"refactorised", "Woodbury"};
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(systems[i]->activate(some_active(prepared)));
    Points kf, kg;
    ASSERT_TRUE(systems[i]->solve(f, kf));
    ASSERT_TRUE(systems[i]->solve(g, kg));
    const double left = kf.cwiseProduct(g).sum(), right = f.cwiseProduct(kg).sum();
    const double error = std::abs(left - right) / std::abs(left);
    EXPECT_TRUE(record_check(
        kAdjointStudy,
        std::string(names[i]) + " with contact " + GetParam().name + ": relative asymmetry", error,
        "<= 1e-9", error <= 1e-9, kAdjointSource));
  }
}

TEST_P(Adjoint, GradientEqualsCentralDifferences) {
  const PreparedModel prepared = model();
  const SparseData data = sagging_data(prepared, 0.3);
  const contact::ActiveSet active = some_active(prepared);
  const Points w = 1e2 * random_points(6), dw = 1e2 * random_points(7);
  const auto at = evaluate_objective(prepared, data, w, active);
  ASSERT_TRUE(at) << at.error().message;
  const double slope = at->gradient.cwiseProduct(prepared.prior().apply(dw)).sum();
  ASSERT_GT(std::abs(slope), 1e-4 * at->value);
  constexpr double kStep = 0.5;
  const auto forward = evaluate_objective(prepared, data, w + kStep * dw, active);
  const auto backward = evaluate_objective(prepared, data, w - kStep * dw, active);
  const double difference = (forward->value - backward->value) / (2.0 * kStep);
  const double error = std::abs(difference - slope) / std::abs(slope);
  EXPECT_TRUE(record_check(
      kAdjointStudy, std::string("gradient with contact ") + GetParam().name + ": relative error",
      error, "<= 1e-6", error <= 1e-6, kAdjointSource));
}

}  // namespace
}  // namespace brainshift::inversion
