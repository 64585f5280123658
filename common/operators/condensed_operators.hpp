// SPDX-License-Identifier: GPL-3.0-or-later
// CondensedOperators: all that an update must know of one patient under one boundary condition,
// as plain arrays.
//
// A displacement is described by prior modes z and contact forces f (N, one per active slave):
//   u = U z + G_A f,     z ~ N(0, I_r),     U U^T ~ C = K^-1 Sigma K^-1
//   G = K^-1 N           column j: unit force on slave j along its normal N_j, from skull to brain
//   Phi = N^T K^-1 N     compliance of the slaves, mm/N
// n nodes, r modes, s slaves. Nodal arrays are node-major (x0 y0 z0 x1 ...), 3n rows.
//
// The columns of U stand in the order of the prior's parts (PriorPart), part_columns[g] of them for
// part g. Those of the load families are K^-1 M, exact. Those of each residual field come from a
// randomised Nystrom approximation of K^-1 Sigma_g K^-1 (Halko, Martinsson, Tropp 2011, SIAM Review
// 53:217, sec. 5.5). Its test vectors are supported where data come from: near the tumour, at the
// craniotomy and on the slaves.
// What the search reads is kept as it was solved: compliance and slave_modes in double precision, U
// and G near the data in single. U and G of all nodes are only summed up to displacements: compact
// (encode_columns.hpp says what that costs).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/types.hpp"
#include "common/operators/compact_columns.hpp"
#include "common/values/estimate.hpp"

namespace brainshift {

struct CondensedOperators {
  Boundary boundary = Boundary::kContact;
  std::string model_id;  // of the BrainModel they belong to

  double prepare_s = 0.0;         // time it took to factorise and condense
  PerPart<int> part_columns{};    // columns of U that belong to each part of the prior
  CompactColumns responses;       // [U G], 3n x (r + s), mm and mm/N
  Eigen::MatrixXd compliance;     // Phi, s x s, mm/N, symmetric
  Eigen::MatrixXd slave_modes;    // N^T U, s x r, mm
  Points slave_normals;           // 3 x s, unit, from skull into brain
  VecX initial_penetration_mm;    // s; negative: open
  std::vector<NodeIndex> slaves;  // s

  // Nodes near the data, and their rows of [U G] in single precision: the search reads them. The
  // strengths that it finds are sensitive to the last digits.
  std::vector<NodeIndex> region;     // e, sorted
  Eigen::MatrixXf region_responses;  // 3e x (r + s)
  // Nodes where the standard deviation is evaluated, and the variance per node that the
  // truncation of each residual field leaves out: tr(C_g - U_g U_g^T) / 3, mm^2, for the free body.
  std::vector<NodeIndex> control;          // c, sorted
  Eigen::MatrixXd truncated_variance_mm2;  // c x kRemainders
  // Interpolation from the control nodes to every node: 4 x n indices into `control` and 4 x n
  // weights whose sum is 1 per node.
  Eigen::Matrix<int, 4, Eigen::Dynamic> control_neighbours;
  Eigen::Matrix<float, 4, Eigen::Dynamic> control_weights;

  int num_nodes() const { return responses.num_nodes(); }
  int num_modes() const { return static_cast<int>(slave_modes.cols()); }
  int first_column(PriorPart part) const;
  int columns(PriorPart part) const { return part_columns[static_cast<std::size_t>(part)]; }
  // Buoyancy along and across gravity: the first columns.
  int gravity_modes() const { return first_column(PriorPart::kTumourVolume); }
  int num_slaves() const { return static_cast<int>(slaves.size()); }
  // The column of a slave in `responses`.
  int contact_column(int slave) const { return num_modes() + slave; }
  // Memory held by the arrays.
  std::uint64_t bytes() const;
};

inline int CondensedOperators::first_column(PriorPart part) const {
  int first = 0;
  for (std::size_t g = 0; g < static_cast<std::size_t>(part); ++g) first += part_columns[g];
  return first;
}

inline std::uint64_t CondensedOperators::bytes() const {
  const auto of = [](const auto& values) -> std::uint64_t {
    return static_cast<std::uint64_t>(values.size()) * sizeof(*values.data());
  };
  return responses.bytes() + of(compliance) + of(slave_modes) + of(slave_normals) +
         of(initial_penetration_mm) + of(slaves) + of(region) + of(region_responses) + of(control) +
         of(truncated_variance_mm2) + of(control_neighbours) + of(control_weights);
}

}  // namespace brainshift
