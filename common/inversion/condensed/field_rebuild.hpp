// SPDX-License-Identifier: GPL-3.0-or-later
// FieldRebuild: displacement at every node, and its standard deviation, from modes and contact
// forces.
//
//   u = U z + G_A f                                            every node, single precision
//   Cov(u) = V Cov(z) V^T + left out,   V = U - G_A T           at the control nodes, interpolated
//                                                               to the others
// sd of a node: root mean square of its three components' standard deviations. Given the active
// set: which slaves touch is taken as known.
//
// Reads (r + k) columns of 3n floats once, split over the team by rows. Results do not depend on
// timing. With a region of interest only its rows are read, gathered by the constructor, and the
// other nodes are interpolated (far_field.hpp). For the same z and f the rebuilt nodes then have
// the displacement that they have in the whole field, within 1e-9 mm (with the loops as they are,
// to the bit). Does not allocate after construction, but for outputs of the wrong size.
#pragma once

#include <memory>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/far_field.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/skull/contact_at_loads.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/linalg/blas.hpp"
#include "common/values/condensed_operators.hpp"

namespace brainshift::inversion {

class FieldRebuild {
 public:
  // Keeps a reference to the operators. region: sorted nodes that are rebuilt; empty: all.
  FieldRebuild(const CondensedOperators& operators, ModeWindow window,
               const std::vector<NodeIndex>& region = {});

  // u: 3 x n, mm.
  void displacement(ThreadTeam& team, const VecX& z, const ContactAtLoads& contact, Points& u);
  // u: 3 x nodes, mm, at these nodes only.
  void displacement_at(ThreadTeam& team, const std::vector<NodeIndex>& nodes, const VecX& z,
                       const ContactAtLoads& contact, Points& u) const;
  // Upper estimate of what interpolation did to the last displacement(), mm; 0 when every node was
  // rebuilt.
  double far_field_error_mm() const { return far_field_error_mm_; }
  // Greatest |U_g dg + U dz + G_A df| at a control node, mm; U_g: the modes before the window.
  double greatest_control_move(const VecX& dg, const VecX& dz, const ContactReduction& contact,
                               const VecX& df) const;
  // covariance_factor: F, r x r, lower, Cov(z) = F F^T. left_out: mean squared strength of each
  // remainder, for the variance that its modes leave out. sd: n, mm.
  void standard_deviation(ThreadTeam& team, const ContactReduction& contact,
                          const linalg::blas::In<double>& covariance_factor,
                          const RemainderVariances& left_out, VecX& sd);

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  // field_ = sum of columns, for all nodes or those of far_.rebuilt
  void sum_columns(ThreadTeam& team, const VecX& z, const ContactAtLoads& contact);
  void interpolate_far(ThreadTeam& team, const ContactAtLoads& contact, Points& u);
  Vec3 interpolated(NodeIndex node) const;

  FarField far_;
  Eigen::MatrixXf near_modes_, near_contact_;  // rows of U and G of far_.rebuilt
  double far_field_error_mm_ = 0.0;
  // What sum_columns adds up: columns of U and G with their z and f.
  std::vector<const float*> columns_;
  std::vector<float> factors_;
  Eigen::VectorXf field_;
  // Control nodes: rows of U and G, V, and what a set needs of them.
  Eigen::MatrixXf control_modes_, control_contact_, response_, factor_, conditioned_, spread_;
  std::unique_ptr<float[]> contact_storage_;
  VecX control_variance_;
};

}  // namespace brainshift::inversion
