// SPDX-License-Identifier: GPL-3.0-or-later
// The toy patient, prepared, and data of a surgery on it.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "common/core/random.hpp"
#include "common/fem/body_loads.hpp"
#include "common/fem/sampling.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/sparse_data.hpp"
#include "tests/support/contact_search.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::inversion {

inline VecX flat(const Points& u) { return Eigen::Map<const VecX>(u.data(), u.size()); }

inline std::shared_ptr<const BrainModel> patient() {
  static const auto model = std::make_shared<const BrainModel>(test_support::toy_patient());
  return model;
}

inline PreparedModel prepare(Boundary boundary,
                             const CaseConfig& config = test_support::toy_config()) {
  return value_or_fail(PreparedModel::prepare(patient(), config, boundary));
}

// Noisy displacements of points on the tumour, from a sagging truth.
inline SparseData sagging_data(const PreparedModel& model, double noise_mm) {
  const BrainModel& brain = model.model();
  const Points load =
      fem::buoyancy_load(brain.mesh, model.config().material, brain.gravity_direction,
                         brain.fluid_plane_depth_mm + 25.0, brain.gravity_direction);
  const auto truth = value_or_fail(test_support::solve_with_contact(model.forward(), 40.0 * load));
  Random random(4);
  SparseData data;
  data.positions = brain.tumour.vertices;
  const auto sampling =
      fem::sampling_matrix(model.locator(), brain.mesh.num_nodes(), data.positions, 1.0);
  data.displacements = (*sampling * truth.displacement.transpose()).transpose();
  for (Eigen::Index i = 0; i < data.displacements.cols(); ++i) {
    data.displacements.col(i) += noise_mm * random.direction();
  }
  data.sd_mm = VecX::Constant(data.positions.cols(), 0.2);
  return data;
}

// Every third slave.
inline contact::ActiveSet some_active(const PreparedModel& model) {
  contact::ActiveSet active(static_cast<std::size_t>(model.forward().contact().num_slaves()), 0);
  for (std::size_t i = 0; i < active.size(); i += 3) active[i] = 1;
  return active;
}

// Posterior mean of the displacement when no slave can be active, formed with dense matrices:
//   u = C A^T (A C A^T + W_e^-1)^-1 d,  C = K^-1 Sigma K^-T
inline VecX dense_posterior_mean(const PreparedModel& model, const SparseData& data) {
  const int n = patient()->mesh.num_nodes();
  const auto sampling = fem::sampling_matrix(model.locator(), n, data.positions, 1.0);
  const Eigen::MatrixXd scalar_a(*sampling);
  const int m = 3 * data.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(m, 3 * n);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(m, m);
  for (int i = 0; i < data.size(); ++i) {
    for (int k = 0; k < n; ++k) a.block<3, 3>(3 * i, 3 * k) = scalar_a(i, k) * Mat3::Identity();
    covariance.block<3, 3>(3 * i, 3 * i) = data.sd_mm[i] * data.sd_mm[i] * Mat3::Identity();
  }
  Eigen::MatrixXd c_at(3 * n, m);  // C A^T
  for (int j = 0; j < m; ++j) {
    const VecX column = a.row(j).transpose();
    const Points adjoint = model.forward().solve(Eigen::Map<const Points>(column.data(), 3, n));
    c_at.col(j) = flat(model.forward().solve(model.prior().apply(adjoint)));
  }
  const Eigen::MatrixXd s = a * c_at + covariance;
  return c_at * test_support::solve_positive(s, flat(data.displacements));
}

}  // namespace brainshift::inversion
