// SPDX-License-Identifier: GPL-3.0-or-later
// FieldRebuild: displacement at every node, and its standard deviation, from modes and contact
// forces.
//
//   u = U z + G_A f                                            every node, single precision
//   Cov(u) = V Cov(z) V^T + left out,   V = U - G_A T           at the control nodes, interpolated
//                                                               to the others
//   known = 1 - sqrt(Cov_0(u) / Cov_0(u without data)), traces, Cov_0: of the broad hypothesis
//
// sd of a node: root mean square of its three components' standard deviations. Given the active
// set: which slaves touch is taken as known.
//
// Reads r + k compact columns once (compact_columns.hpp), split over the team by blocks of nodes.
// Results do not depend on timing. With a region of interest only blocks with a node of it are
// summed, beside control and probe nodes, whose rows the constructor unpacks; the other nodes are
// interpolated (FarField). For the same z and f the nodes of the region then have the
// displacement that they have in the whole field, within 1e-9 mm (with the loops as they are, to
// the bit), control and probe nodes within kOmitted_mm and 1e-6 of their largest term. Does not
// allocate after construction, but for outputs of the wrong size.
#pragma once

#include <memory>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/skull/contact_at_loads.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/linalg/blas.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// FarField: which nodes a rebuild sums up from modes and contact forces, and which it interpolates.
//
// A scene may ask for a region of interest only. Then the nodes of the region, the control nodes
// and kProbes probe nodes are rebuilt, as in the whole field (FieldRebuild); every other node
// is interpolated from the control nodes (CondensedOperators::control_neighbours). The probes
// measure the price in every update:
//   error <= kFarFieldSafety * max( |u_probe - interpolated|,
//                                   |N_i . (u_i - interpolated)| over far slaves )
// Probes are the far nodes where interpolating the modes is worst, sum_j |U_j - interpolated|^2
// (the variance of the interpolation error under the prior), no two between the same control nodes.
// The normal displacement of a slave is known from its penetration without rebuilding it.
inline constexpr int kProbes = 64;
// Between probes the error may be larger: up to 1.2 times the greatest probe's on the toy patient,
// 1.04 times on the default head (tests/benchmarks/bench_scenes.cpp).
inline constexpr double kFarFieldSafety = 2.0;

// Directions of a block are left out of displacement() as long as no node of it moves by more: half
// of what contact and field may be apart (estimate_check.hpp).
inline constexpr float kOmitted_mm = 5e-4F;

struct FarField {
  std::vector<NodeIndex> rebuilt;  // sorted; empty: every node
  std::vector<int> row;            // per node: index into `rebuilt`, -1 when interpolated
  std::vector<NodeIndex> probes;   // rebuilt, but neither in the region nor control nodes
  std::vector<int> far_slaves;     // indices of slaves that are interpolated

  bool empty() const { return rebuilt.empty(); }
};

class FieldRebuild {
 public:
  // Keeps a reference to the operators. region: sorted nodes that are rebuilt; empty: all. team:
  // of the constructor's work.
  FieldRebuild(const CondensedOperators& operators, ModeWindow window, ThreadTeam& team,
               const std::vector<NodeIndex>& region = {});

  // u: 3 x n, mm.
  void displacement(ThreadTeam& team, const VecX& z, const ContactAtLoads& contact, Points& u);
  // u: 3 x nodes, mm, at these nodes only.
  void displacement_at(ThreadTeam& team, const std::vector<NodeIndex>& nodes, const VecX& z,
                       const ContactAtLoads& contact, Points& u);
  // Upper estimate of what interpolation did to the last displacement(), mm; 0 when every node was
  // rebuilt.
  double far_field_error_mm() const { return far_field_error_mm_; }
  // Greatest |U_g dg + U dz + G_A df| at a control node, mm; U_g: the modes before the window.
  double greatest_control_move(const VecX& dg, const VecX& dz, const ContactReduction& contact,
                               const VecX& df) const;
  // covariance_factor: F, r x r, lower, Cov(z) = F F^T. left_out: mean squared strength of each
  // residual field, for the variance that its modes leave out. sd: n, mm.
  void standard_deviation(ThreadTeam& team, const ContactReduction& contact,
                          const linalg::blas::In<double>& covariance_factor,
                          const RemainderVariances& left_out, VecX& sd);
  // How much of a node's prior variance the data took away, under the broad hypothesis
  // (prior_strengths.hpp): 0 none, 1 all. explained: X, k x r, variances: S^2, r, with Cov(z) = S^2
  // - X^T X. For the contact of the last standard_deviation(). known: n.
  void known(ThreadTeam& team, const linalg::blas::In<double>& explained, const VecX& variances,
             VecX& known);

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  // terms_ and, for rows that are unpacked, columns_ and factors_: what is summed.
  void gather_terms(const VecX& z, const ContactAtLoads& contact);
  void sum_blocks(ThreadTeam& team, const std::vector<int>& blocks, float omitted_mm);
  void sum_spare(ThreadTeam& team);
  void interpolate_far(ThreadTeam& team, const ContactAtLoads& contact, Points& u);
  Vec3 interpolated(NodeIndex node) const;
  // Where a node's displacement stands in field_ if its block is summed.
  Eigen::Index place(NodeIndex node) const;

  FarField far_;
  std::vector<int> blocks_;          // that are summed by displacement()
  std::vector<Eigen::Index> place_;  // where the nodes of far_.rebuilt stand in field_
  // Control and probe nodes in other blocks: their number, rows of U and G.
  Eigen::MatrixXf spare_modes_, spare_contact_;
  double far_field_error_mm_ = 0.0;
  std::vector<CompactColumns::Term> terms_;
  std::vector<const float*> columns_;
  std::vector<float> factors_;
  Eigen::VectorXf field_;         // in the order of the blocks, then the spare nodes
  std::vector<int> some_blocks_;  // of displacement_at()
  std::vector<char> has_block_;
  // Control nodes: rows of U and G, V, and what a set needs of them.
  Eigen::MatrixXf control_modes_, control_contact_, response_, factor_, conditioned_, spread_;
  Eigen::VectorXf prior_squares_;              // variances of the modes, r
  Eigen::VectorXf squares_, prior_at_;         // of the control nodes' rows: |row|^2
  std::unique_ptr<float[]> explained_, seen_;  // X^T, and V X^T
  std::unique_ptr<float[]> contact_storage_;
  VecX control_variance_, control_known_;
  void interpolate(ThreadTeam& team, const VecX& at_control, VecX& out) const;
};

}  // namespace brainshift::inversion
