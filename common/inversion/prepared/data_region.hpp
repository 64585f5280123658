// SPDX-License-Identifier: GPL-3.0-or-later
// Where data come from: the nodes that condensed operators are prepared for.
#pragma once

#include <cstdint>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/core/error.hpp"

namespace brainshift::inversion {

inline constexpr double kRegionMargin_mm = 8.0;

// Nodes within the margin of the tumour surface or of a craniotomy node, and those of the tetrahedra that the tumour
// surface passes through (at its vertices and the centres of its triangles); sorted.
std::vector<NodeIndex> data_region(const BrainModel& model);

// Ok, or kInvalidArgument when a preparation that needs so many bytes (the model's own included) exceeds
// condensed.memory_limit_gib; the sentence names both.
Status check_memory(std::uint64_t bytes, double limit_gib, int slaves, int nodes);

}  // namespace brainshift::inversion
