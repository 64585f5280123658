// SPDX-License-Identifier: GPL-3.0-or-later
// OutputOperators: the whole prior, seen through the outputs y = H u that data and contact can
// touch.
//
//   H = [E; Q]              E: the three components at each node of the data region; Q: N^T, slave
//                           normals
//   Phi = H K^-1 H^T        what unit forces at the outputs move there, mm/N
//   Psi = H C H^T           prior covariance of the free body's outputs, mm^2;  C = K^-1 Sigma K^-1
// h = 3 |region| + s rows: first the region, node by node, then the slaves. Double precision
// throughout.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::inversion {

struct OutputOperators {
  std::vector<NodeIndex> region;  // sorted
  Eigen::MatrixXd compliance;     // Phi, h x h, symmetric
  Eigen::MatrixXd covariance;     // Psi, h x h, symmetric

  Eigen::Index region_rows() const { return 3 * static_cast<Eigen::Index>(region.size()); }
};

// h solves and 3 n h^2 multiplications, dealt to the cores in a fixed partition: bit-identical for
// any number of threads. progress: stages "influence columns" and "prior covariance".
// kInvalidArgument when condensed.memory_limit_gib is below the factor and output_operators_bytes
// (the sentence names both); kUnavailable when stopped; kNotFinite.
Result<OutputOperators> output_operators(const PreparedModel& model, const Progress& progress = {},
                                         const std::stop_token& stop = {}, int threads = 0);

// Peak memory of the arrays of output_operators(), bytes.
std::uint64_t output_operators_bytes(int nodes, int outputs, int threads);

}  // namespace brainshift::inversion
