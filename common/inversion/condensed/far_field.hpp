// SPDX-License-Identifier: GPL-3.0-or-later
// FarField: which nodes a rebuild sums up from modes and contact forces, and which it interpolates.
//
// A scene may ask for a region of interest only. Then the nodes of the region, the control nodes
// and kProbes probe nodes are rebuilt, as in the whole field (field_rebuild.hpp); every other node
// is interpolated from the control nodes (CondensedOperators::control_neighbours). The probes
// measure the price in every update:
//   error <= kFarFieldSafety * max( |u_probe - interpolated|,
//                                   |N_i . (u_i - interpolated)| over far slaves )
// Probes are the far nodes where interpolating the modes is worst, sum_j |U_j - interpolated|^2
// (the variance of the interpolation error under the prior), no two between the same control nodes.
// The normal displacement of a slave is known from its penetration without rebuilding it.
#pragma once

#include <vector>

#include "common/core/thread_team.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

inline constexpr int kProbes = 64;
// Between probes the error may be larger: up to 1.2 times the greatest probe's on the toy patient,
// 1.04 times on the default head (tests/benchmarks/bench_scenes.cpp).
inline constexpr double kFarFieldSafety = 2.0;

struct FarField {
  std::vector<NodeIndex> rebuilt;  // sorted; empty: every node
  std::vector<int> row;            // per node: index into `rebuilt`, -1 when interpolated
  std::vector<NodeIndex> probes;   // rebuilt, but neither in the region nor control nodes
  std::vector<int> far_slaves;     // indices of slaves that are interpolated

  bool empty() const { return rebuilt.empty(); }
};

// region: sorted nodes that must be exact; empty: every node, and the result is empty.
FarField plan_far_field(const CondensedOperators& operators, ModeWindow window,
                        const std::vector<NodeIndex>& region, ThreadTeam& team);

}  // namespace brainshift::inversion
