// SPDX-License-Identifier: GPL-3.0-or-later
// The data region: the nodes near the places where data are measured. Condensed operators are
// prepared for them. (A scene's region of interest is something else: the nodes where an answer is
// wanted.)
#pragma once

#include <vector>

#include "common/values/brain_model.hpp"

namespace brainshift::inversion {

inline constexpr double kRegionMargin_mm = 8.0;

// Nodes within the margin of the tumour surface or of a craniotomy node, and the nodes of the
// tetrahedra that the tumour surface passes through (at its vertices and the centres of its
// triangles); sorted.
std::vector<NodeIndex> data_region(const BrainModel& model);

}  // namespace brainshift::inversion
