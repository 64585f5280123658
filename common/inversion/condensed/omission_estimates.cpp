// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/omission_estimates.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

using Eigen::MatrixXd;

double contact_error_mm(const VecX& penetration) {
  return penetration.size() > 0 ? kContactSafety * std::max(0.0, penetration.maxCoeff()) : 0.0;
}

double gravity_modes_error_mm(SampledOperators& sampled, const ContactReduction& contact,
                              const FieldRebuild& rebuild,
                              const Eigen::Ref<const MatrixXd>& jacobian,
                              const Eigen::Ref<const VecX>& residual,
                              const Eigen::Ref<const MatrixXd>& normal_factor) {
  MatrixXd gravity = sampled.modes_before();  // J_g
  if (gravity.cols() == 0) return 0.0;
  const MatrixXd forces = contact.response_before();  // T_g
  if (contact.size() > 0) gravity -= sampled.contact(contact.active()) * forces;
  const MatrixXd coupling = jacobian.transpose() * gravity;
  MatrixXd explained = coupling;
  linalg::blas::solve_lower(normal_factor, explained);
  linalg::blas::solve_lower_transposed(normal_factor, explained);
  MatrixXd schur = gravity.transpose() * gravity - coupling.transpose() * explained;
  schur.diagonal().array() += 1.0;
  const VecX dg = schur.ldlt().solve(gravity.transpose() * residual);
  const VecX dz = -(explained * dg).tail(jacobian.cols() - sampled.common());
  VecX df = -forces * dg;
  if (contact.size() > 0) df -= contact.response().leftCols(dz.size()) * dz;
  return kGravitySafety * rebuild.greatest_control_move(dg, dz, contact, df);
}

}  // namespace brainshift::inversion
