// SPDX-License-Identifier: GPL-3.0-or-later
// From a problem file's contents and its mesh to a ForwardProblem: converts units, resolves
// names.
#pragma once

#include <vector>

#include "common/configuration/problem_spec.hpp"
#include "common/core/mesh.hpp"
#include "common/forward/forward_problem.hpp"

namespace brainshift::forward {

// surfaces: one per contact that names a surface file, in order. Messages begin with the key.
// kInvalidArgument, kEmptySet (a name that selects nothing), kDegenerateMesh.
Result<ForwardProblem> build_problem(const ProblemSpec& spec, GroupedMesh mesh,
                                     const std::vector<TriangleSurface>& surfaces);

// In internal units. Precondition: Poisson's ratio below 0.5.
fem::PoroMaterial poro_material_from(const MaterialSpec& material);

}  // namespace brainshift::forward
