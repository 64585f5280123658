// SPDX-License-Identifier: GPL-3.0-or-later
// Inversion with pore pressure: one implicit step of consolidation in the place of drained
// elasticity.
#include <gmock/gmock.h>

#include "common/contact/penalised_system.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/inverter.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

// The toy patient relaxes in about half a second (R^2/c_v).
CaseConfig with_pressure(double step_s) {
  CaseConfig config = test_support::toy_config();
  config.condensed.max_rank = 600;
  config.condensed.uncertainty_nodes = 40;
  config.scene.pressure = Carry::kOn;
  config.scene.pressure_step_s = step_s;
  config.prior.estimate_scales = false;  // as the reference has them
  return config;
}

CaseConfig drained() {
  CaseConfig config = with_pressure(1.0);
  config.scene.pressure = Carry::kAuto;
  return config;
}

Estimate condensed_estimate(const PreparedModel& model, const SparseData& data) {
  auto operators = value_or_fail(condense(model));
  auto inverter = value_or_fail(CondensedInverter::build(
      std::make_shared<const CondensedOperators>(std::move(operators)),
      std::make_shared<const geometry::TetLocator>(model.model().mesh), model.config(), {}));
  Estimate estimate;
  const auto status = inverter.update(data, estimate);
  EXPECT_TRUE(status.has_value()) << status.error().message;
  return estimate;
}

Estimate iterated_estimate(const PreparedModel& model, const SparseData& data, Method method) {
  return value_or_fail(invert(model, data, method));
}

double relative_difference(const Points& a, const Points& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

// K_b = K + G C^-1 G^T, and the contact stiffness of the active slaves, as a dense matrix in the
// unknowns.
Eigen::MatrixXd dense_stiffness(const PreparedModel& model, const contact::ActiveSet& active) {
  const contact::ForwardModel& forward = model.forward();
  const TetMesh& mesh = model.model().mesh;
  const auto& triangles = model.model().boundary_triangles;
  const fem::BiotMatrix biot = fem::assemble_biot(
      mesh,
      fem::MaterialMap::uniform(fem::poro_material_from(model.config().material), mesh.num_tets()),
      forward.dofs(),
      fem::PressureMap(mesh.num_nodes(), {triangles.data(), triangles.data() + triangles.size()}),
      model.config().scene.pressure_step_s);
  const Eigen::Index nu = biot.displacement_unknowns, np = biot.pressure_unknowns;
  const Eigen::MatrixXd whole(linalg::SymmetricMatrix(biot.lower.selfadjointView<Eigen::Lower>()));
  linalg::SymmetricMatrix k_p = forward.stiffness();
  forward.contact().add_stiffness(k_p, forward.dofs(), active);
  Eigen::MatrixXd dense(linalg::SymmetricMatrix(k_p.selfadjointView<Eigen::Lower>()));
  dense -= whole.topRightCorner(nu, np) *
           whole.bottomRightCorner(np, np).partialPivLu().solve(whole.bottomLeftCorner(np, nu));
  return dense;
}

contact::ActiveSet active_set(const PreparedModel& model, const Estimate& estimate) {
  contact::ActiveSet active(static_cast<std::size_t>(model.forward().contact().num_slaves()), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const NodeIndex slave = model.forward().contact().pairs()[i].slave;
    active[i] = std::count(estimate.active_slaves.begin(), estimate.active_slaves.end(), slave) > 0;
  }
  return active;
}

TEST(Pressure, SystemsWithAndWithoutRefactorisationEqualTheDenseOne) {
  const PreparedModel model = prepare(Boundary::kContact, with_pressure(0.2));
  ASSERT_EQ(model.forward().factor().drained(), nullptr);
  contact::RefactorisedSystem refactorised(model.forward());
  contact::WoodburySystem woodbury(model.forward());
  const contact::ActiveSet active = some_active(model);
  ASSERT_TRUE(refactorised.activate(active) && woodbury.activate(active));
  const Points load =
      fem::buoyancy_load(patient()->mesh, model.config().material, {0, 0, -1}, 60.0, {0, 0, -1});
  ASSERT_GT(load.norm(), 0.0);
  Points a, b;
  ASSERT_TRUE(refactorised.solve(load, a) && woodbury.solve(load, b));
  const fem::DofMap& dofs = model.forward().dofs();
  const Points expected =
      dofs.expand(dense_stiffness(model, active).partialPivLu().solve(dofs.restrict_to(load)));
  EXPECT_LT(relative_difference(a, expected), 1e-9);
  EXPECT_LT(relative_difference(b, expected), 1e-9);
  // Pressure holds fluid back: the result is not the drained one.
  EXPECT_GT(
      relative_difference(expected, prepare(Boundary::kContact, drained()).forward().solve(load)),
      0.01);
}

// Posterior mean for the set of active slaves, by dense algebra.
VecX direct_mean(const PreparedModel& model, const SparseData& data,
                 const contact::ActiveSet& active) {
  const fem::DofMap& dofs = model.forward().dofs();
  const int n = patient()->mesh.num_nodes();
  const Eigen::MatrixXd inverse = test_support::inverse(dense_stiffness(model, active));
  const auto response = [&](const VecX& force) {
    return flat(dofs.expand(
        inverse * dofs.restrict_to(Points(Eigen::Map<const Points>(force.data(), 3, n)))));
  };
  const auto sampling = fem::sampling_matrix(model.locator(), n, data.positions, 1.0);
  const Eigen::MatrixXd weights(*sampling);
  const int m = 3 * data.size();
  Eigen::MatrixXd c_at(3 * n, m), innovation(m, m);
  const auto sample = [&](const VecX& u) {
    const Points sampled = Eigen::Map<const Points>(u.data(), 3, n) * weights.transpose();
    return flat(sampled);
  };
  for (int j = 0; j < m; ++j) {
    Points row = Points::Zero(3, n);
    row.row(j % 3) = weights.row(j / 3);
    const VecX adjoint = response(flat(row));
    c_at.col(j) =
        response(flat(model.prior().apply(Points(Eigen::Map<const Points>(adjoint.data(), 3, n)))));
    innovation.col(j) = sample(c_at.col(j));
    innovation(j, j) += data.sd_mm[j / 3] * data.sd_mm[j / 3];
  }
  Points gaps = Points::Zero(3, n);
  model.forward().contact().add_load(gaps, active);
  const VecX shift = response(flat(gaps));
  return shift + c_at * innovation.partialPivLu().solve(flat(data.displacements) - sample(shift));
}

void expect_direct_posterior(const PreparedModel& model, const SparseData& data,
                             const Estimate& estimate) {
  const VecX mean = direct_mean(model, data, active_set(model, estimate));
  const double largest_mm = mean.cwiseAbs().maxCoeff();
  ASSERT_GT(largest_mm, 0.5);
  // Single precision of the modes, which partly cancel.
  EXPECT_LT((flat(estimate.displacement) - mean).cwiseAbs().maxCoeff(), 1e-4 * largest_mm);
}

TEST(Pressure, CondensedEstimateWithContactEqualsTheDirectPosterior) {
  const PreparedModel model = prepare(Boundary::kContact, with_pressure(0.2));
  const SparseData data = sagging_data(model, 0.3);
  const Estimate estimate = condensed_estimate(model, data);
  ASSERT_EQ(estimate.status, EstimateStatus::kConverged);
  ASSERT_GT(estimate.contact.active, 3) << "the test shows nothing without contact";
  expect_direct_posterior(model, data, estimate);
}

TEST(Pressure, LongAfterTheLoadTheEstimateIsTheDrainedOne) {
  const PreparedModel limit = prepare(Boundary::kContact, drained());
  const PreparedModel late = prepare(Boundary::kContact, with_pressure(1e9));
  const SparseData data = sagging_data(limit, 0.3);
  const Estimate expected = condensed_estimate(limit, data);
  const Estimate estimate = condensed_estimate(late, data);
  ASSERT_GT(expected.contact.active, 0);
  EXPECT_EQ(estimate.active_slaves, expected.active_slaves);
  EXPECT_LT(relative_difference(estimate.displacement, expected.displacement), 1e-5);
  EXPECT_LT(relative_difference(iterated_estimate(late, data, Method::kPaper).displacement,
                                iterated_estimate(limit, data, Method::kPaper).displacement),
            1e-6);
}

// The minimum of the same objective for their own active set, when they are let run until they are
// there and the data pull weakly enough for that to take hundreds of iterations only.
TEST(Pressure, EveryDescentWithAFactorCarriesIt) {
  CaseConfig patience = with_pressure(0.2);
  patience.inversion.relative_misfit_change = 1e-10;
  patience.inversion.max_iterations = 2000;
  const PreparedModel model = prepare(Boundary::kContact, patience);
  SparseData data = sagging_data(model, 0.1);
  data.sd_mm.setConstant(5.0);
  for (const Method method : {Method::kPaper, Method::kPaperWoodbury}) {
    const Estimate estimate = iterated_estimate(model, data, method);
    EXPECT_EQ(estimate.status, EstimateStatus::kConverged) << to_string(method);
    EXPECT_GT(estimate.contact.active, 0) << to_string(method);
    const VecX minimum = direct_mean(model, data, active_set(model, estimate));
    const double apart_mm = (flat(estimate.displacement) - minimum).cwiseAbs().maxCoeff();
    EXPECT_LT(apart_mm, 1e-6) << to_string(method);
  }
}

TEST(Pressure, FixedBoundaryCarriesItToo) {
  const PreparedModel model = prepare(Boundary::kFixed, with_pressure(0.2));
  EXPECT_EQ(model.forward().factor().drained(), nullptr);
  const SparseData data = sagging_data(model, 0.1);
  const Estimate estimate = condensed_estimate(model, data);
  EXPECT_EQ(estimate.status, EstimateStatus::kConverged);
  EXPECT_EQ(estimate.contact.active, 0);
  expect_direct_posterior(model, data, estimate);
  // Held back by its pressure, the body is not the drained one.
  const Estimate without = condensed_estimate(prepare(Boundary::kFixed, drained()), data);
  EXPECT_GT(relative_difference(estimate.displacement, without.displacement), 1e-3);
}

}  // namespace
}  // namespace brainshift::inversion
