// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/far_field.hpp"

#include <algorithm>
#include <numeric>

#include "common/operators/encode_columns.hpp"

namespace brainshift::inversion {
namespace {

// Variance of each node's interpolation error under the prior, mm^2.
VecX interpolation_variance(const CondensedOperators& operators, ModeWindow window,
                            ThreadTeam& team) {
  std::vector<NodeIndex> all(static_cast<std::size_t>(operators.num_nodes()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::MatrixXf modes =
      decode_rows(operators.responses, all, column_range(window.first, window.count), team);
  VecX variance = VecX::Zero(operators.num_nodes());
  for (int j = 0; j < window.count; ++j) {
    const auto mode = modes.col(j);
    for (int i = 0; i < operators.num_nodes(); ++i) {
      Eigen::Vector3f error = mode.segment<3>(3 * i);
      for (int c = 0; c < 4; ++c) {
        const NodeIndex from =
            operators.control[static_cast<std::size_t>(operators.control_neighbours(c, i))];
        error -= operators.control_weights(c, i) * mode.segment<3>(3 * from);
      }
      variance[i] += static_cast<double>(error.squaredNorm());
    }
  }
  return variance;
}

bool same_neighbours(const CondensedOperators& operators, NodeIndex a, NodeIndex b) {
  return operators.control_neighbours.col(a) == operators.control_neighbours.col(b);
}

}  // namespace

FarField plan_far_field(const CondensedOperators& operators, ModeWindow window,
                        const std::vector<NodeIndex>& region, ThreadTeam& team) {
  FarField plan;
  if (region.empty()) return plan;
  const auto nodes = static_cast<std::size_t>(operators.num_nodes());
  std::vector<char> exact(nodes, 0);
  for (const NodeIndex node : region) exact[static_cast<std::size_t>(node)] = 1;
  for (const NodeIndex node : operators.control) exact[static_cast<std::size_t>(node)] = 1;

  const VecX variance = interpolation_variance(operators, window, team);
  std::vector<NodeIndex> worst(nodes);
  std::iota(worst.begin(), worst.end(), 0);
  std::stable_sort(worst.begin(), worst.end(),
                   [&](NodeIndex a, NodeIndex b) { return variance[a] > variance[b]; });
  for (const NodeIndex node : worst) {
    if (plan.probes.size() == kProbes) break;
    if (exact[static_cast<std::size_t>(node)]) continue;
    // Nodes between the same control nodes tell the same.
    if (std::none_of(plan.probes.begin(), plan.probes.end(),
                     [&](NodeIndex probe) { return same_neighbours(operators, probe, node); })) {
      plan.probes.push_back(node);
    }
  }
  for (const NodeIndex node : plan.probes) exact[static_cast<std::size_t>(node)] = 1;

  plan.row.assign(nodes, -1);
  for (std::size_t i = 0; i < nodes; ++i) {
    if (!exact[i]) continue;
    plan.row[i] = static_cast<int>(plan.rebuilt.size());
    plan.rebuilt.push_back(static_cast<NodeIndex>(i));
  }
  for (std::size_t i = 0; i < operators.slaves.size(); ++i) {
    if (plan.row[static_cast<std::size_t>(operators.slaves[i])] < 0) {
      plan.far_slaves.push_back(static_cast<int>(i));
    }
  }
  return plan;
}

}  // namespace brainshift::inversion
