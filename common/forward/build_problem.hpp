// SPDX-License-Identifier: GPL-3.0-or-later
// From what a problem file says and the mesh it names to a ForwardProblem: units converted, names resolved.
#pragma once

#include <vector>

#include "common/core/grouped_mesh.hpp"
#include "common/values/problem_spec.hpp"
#include "common/forward/forward_problem.hpp"

namespace brainshift::forward {

// Messages begin with the key. kInvalidArgument, kEmptySet (a name that selects nothing), kDegenerateMesh.
// surfaces: one per contact that names a surface file, in order.
Result<ForwardProblem> build_problem(const ProblemSpec& spec, GroupedMesh mesh,
                                     const std::vector<TriangleSurface>& surfaces);

// Consistent units; Poisson's ratio below 0.5.
fem::PoroMaterial poro_material_from(const MaterialSpec& material);

}  // namespace brainshift::forward
