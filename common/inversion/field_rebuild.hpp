// SPDX-License-Identifier: GPL-3.0-or-later
// FieldRebuild: displacement at every node, and its standard deviation, from modes and contact forces.
//
//   u = U z + G_A f                                          every node, single precision
//   Cov(u) = V (I + J^T J)^-1 V^T + left out,   V = U - G_A T   at the control nodes, interpolated to the others
// sd of a node: root mean square of its three components' standard deviations. Given the active set: which
// slaves touch is taken as known. Reads (r + k) columns of 3n floats once, split over the team by rows; results
// do not depend on timing. Does not allocate after construction, but for outputs of the wrong size.
#pragma once

#include <memory>

#include "common/core/condensed_operators.hpp"
#include "common/core/thread_team.hpp"
#include "common/fem/blas.hpp"
#include "common/inversion/contact_reduction.hpp"
#include "common/inversion/mode_window.hpp"

namespace brainshift::inversion {

class FieldRebuild {
 public:
  // Keeps a reference to the operators.
  FieldRebuild(const CondensedOperators& operators, ModeWindow window);

  // u: 3 x n, mm.
  void displacement(ThreadTeam& team, const VecX& z, const ContactReduction& contact, Points& u);
  // normal_factor: lower Cholesky factor of I + J^T J, r x r. sd: n, mm.
  void standard_deviation(ThreadTeam& team, const ContactReduction& contact,
                          const fem::blas::In<double>& normal_factor, VecX& sd);

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  Eigen::VectorXf z_, forces_, field_;
  // Control nodes: rows of U and G, V, and what a set needs of them.
  Eigen::MatrixXf control_modes_, control_contact_, response_, factor_, conditioned_;
  std::unique_ptr<float[]> contact_storage_;
  VecX control_variance_;
};

}  // namespace brainshift::inversion
