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

Result<double> gravity_modes_error_mm(SampledOperators& sampled, const ContactReduction& contact,
                                      const FieldRebuild& rebuild, const ModePosterior& posterior,
                                      const VecX& penetration) {
  MatrixXd gravity = sampled.modes_before();  // J_g
  if (gravity.cols() == 0) return 0.0;
  const auto forces = contact.response_before();  // T_g
  if (!forces) return tl::unexpected(forces.error());
  if (contact.size() > 0) gravity -= sampled.contact(contact.active()) * *forces;
  const MatrixXd coupling = posterior.jacobian().transpose() * gravity;
  MatrixXd explained = coupling;
  posterior.solve_normal(explained);
  MatrixXd schur = gravity.transpose() * gravity - coupling.transpose() * explained;
  schur.diagonal().array() += 1.0;
  const VecX dg = schur.ldlt().solve(gravity.transpose() * posterior.residual());
  const VecX dz = -(explained * dg).tail(posterior.unknowns() - sampled.common());
  VecX df = -*forces * dg;
  if (contact.size() > 0) df -= contact.response().leftCols(dz.size()) * dz;
  VecX after = penetration + contact.penetration_change(dg, dz, df);
  for (const int slave : contact.active()) after[slave] = 0.0;
  return kGravitySafety * rebuild.greatest_control_move(dg, dz, contact, df) +
         contact_error_mm(after);
}

}  // namespace brainshift::inversion
