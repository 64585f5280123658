// SPDX-License-Identifier: GPL-3.0-or-later
// Shared by the studies of forward::solve: groups by predicate, one material, solving.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "common/forward/forward_problem.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::verification {

inline fem::Elasticity elasticity(double youngs, double nu) {
  const double shear = youngs / (2.0 * (1.0 + nu));
  return {2.0 * shear * nu / (1.0 - 2.0 * nu), shear};
}

// Boundary faces whose three vertices satisfy the predicate.
inline forward::FaceGroup faces_where(const TetMesh& mesh,
                                      const std::function<bool(const Vec3&)>& holds) {
  const auto boundary = geometry::boundary_triangles(mesh);
  forward::FaceGroup group;
  std::vector<int> chosen;
  std::vector<char> used(static_cast<std::size_t>(mesh.num_nodes()), 0);
  for (int f = 0; f < boundary.cols(); ++f) {
    bool whole = true;
    for (int k = 0; k < 3; ++k) whole = whole && holds(mesh.nodes.col(boundary(k, f)));
    if (!whole) continue;
    chosen.push_back(f);
    for (int k = 0; k < 3; ++k) used[static_cast<std::size_t>(boundary(k, f))] = 1;
  }
  group.faces = boundary(Eigen::all, chosen);
  for (int n = 0; n < mesh.num_nodes(); ++n)
    if (used[static_cast<std::size_t>(n)] != 0) group.vertices.push_back(n);
  return group;
}

inline forward::ForwardProblem problem_on(TetMesh mesh, fem::Element element,
                                          const fem::Elasticity& material) {
  forward::ForwardProblem problem;
  problem.materials = fem::MaterialMap::uniform({material}, mesh.num_tets());
  problem.mesh = std::move(mesh);
  problem.element = element;
  return problem;
}

// Adds a condition on the faces where the predicate holds; group and condition share the name.
inline void add_condition(forward::ForwardProblem& problem, const std::string& name,
                          const std::function<bool(const Vec3&)>& holds,
                          decltype(forward::Condition::what) what) {
  problem.groups[name] = faces_where(problem.mesh, holds);
  problem.conditions.push_back({name, name, std::move(what)});
}

// The three symmetry planes of an octant.
inline void add_symmetry(forward::ForwardProblem& problem, bool also_z) {
  for (int axis = 0; axis < (also_z ? 3 : 2); ++axis) {
    add_condition(
        problem, "symmetry " + std::to_string(axis),
        [axis](const Vec3& x) { return x[axis] == 0.0; }, forward::NormalDisplacement{0.0});
  }
}

inline forward::ForwardSolution solved(const forward::ForwardProblem& problem) {
  auto solution = forward::solve(problem);
  if (!solution) throw std::runtime_error(solution.error().message);
  return std::move(*solution);
}

inline const char* name_of(fem::Element element) {
  return element == fem::Element::kP1 ? "P1" : "P2";
}

}  // namespace brainshift::verification
