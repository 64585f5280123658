// SPDX-License-Identifier: GPL-3.0-or-later
// Shared by the consolidation studies: brain-like tissue and a laterally confined column.
#pragma once

#include <gtest/gtest.h>

#include "common/fem/biot.hpp"
#include "common/fem/space_elasticity.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::fem {

// Table 1 with its Poisson's ratio replaced; incompressible constituents (alpha = 1, S = 0).
inline PoroMaterial tissue(double poisson_ratio) {
  Material table;
  table.poisson_ratio = poisson_ratio;
  PoroMaterial material;
  material.elastic = elasticity_from(table);
  material.permeability = 1e5;  // 1e-7 m^3 s/kg
  return material;
}

// Boundary triangles whose corners all belong to `nodes`.
inline Eigen::Matrix3Xi faces_of(const TetMesh& mesh, const std::vector<NodeIndex>& nodes) {
  std::vector<char> chosen(static_cast<std::size_t>(mesh.num_nodes()), 0);
  for (const NodeIndex n : nodes) chosen[static_cast<std::size_t>(n)] = 1;
  const Eigen::Matrix3Xi boundary = geometry::boundary_triangles(mesh);
  Eigen::Matrix3Xi faces(3, boundary.cols());
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < boundary.cols(); ++f) {
    const auto is_chosen = [&](int k) { return chosen[static_cast<std::size_t>(boundary(k, f))]; };
    if (is_chosen(0) && is_chosen(1) && is_chosen(2)) faces.col(count++) = boundary.col(f);
  }
  return faces.leftCols(count);
}

// A column of `layers` layers, one cell across, height along z. Sides: sealed and fixed
// laterally. Bottom: sealed and fixed. Top: drained and loaded with pressure q.
struct Column {
  static constexpr double kHeight = 10.0, kWidth = 0.5;
  TetMesh mesh;
  DofMap dofs{0};
  std::vector<NodeIndex> top;
  std::vector<NodeIndex> axis;  // one edge, from bottom to top
  BiotLoad load;

  Column(int layers, double q)
      : mesh(test_support::box_mesh(1, 1, layers, Vec3(kWidth, kWidth, kHeight))),
        dofs(mesh.num_nodes()) {
    const auto on_top = [&](int n) { return mesh.nodes(2, n) > kHeight - 1e-9; };
    for (int n = 0; n < mesh.num_nodes(); ++n) {
      dofs.fix_component(n, 0);
      dofs.fix_component(n, 1);
      if (mesh.nodes(2, n) == 0.0) dofs.fix_component(n, 2);
      if (on_top(n)) top.push_back(n);
      if (mesh.nodes(0, n) == 0.0 && mesh.nodes(1, n) == 0.0) axis.push_back(n);
    }
    dofs.finalise();
    load.force = pressure_load(make_space(mesh, Element::kP1), faces_of(mesh, top), q);
  }
  BiotStepper stepper(const PoroMaterial& material, const BiotOptions& options = {}) const {
    return value_or_fail(BiotStepper::build(mesh, MaterialMap::uniform(material, mesh.num_tets()),
                                            dofs, top, options));
  }
};

// `steps` equal steps of dt under a constant load.
inline void advance(BiotStepper& stepper, BiotState& state, const BiotLoad& load, double dt_s,
                    int steps) {
  for (int i = 0; i < steps; ++i) state = value_or_fail(stepper.step(state, load, dt_s));
}

}  // namespace brainshift::fem
