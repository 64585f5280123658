// SPDX-License-Identifier: GPL-3.0-or-later
// A cube of tetrahedra as test model: 10 mm wide, 4 x 4 x 4 cells.
#pragma once

#include "common/geometry/surface.hpp"
#include "common/values/brain_model.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::client {

inline TetMesh box_mesh() { return test_support::box_mesh(4, 4, 4, Vec3::Constant(10.0)); }

// Its craniotomy: the nodes of the top face (largest z) that do not lie on its rim.
inline BrainModel box_model() {
  BrainModel model;
  model.case_id = "box";
  model.model_id = "0123456789abcdef";
  model.mesh = box_mesh();
  model.boundary_triangles = geometry::boundary_triangles(model.mesh);
  model.craniotomy = test_support::nodes_where(model.mesh, [](const Vec3& x) {
    return x.z() > 9.9 && x.head<2>().minCoeff() > 0.1 && x.head<2>().maxCoeff() < 9.9;
  });
  model.gravity_direction = Vec3(0, 0, -1);
  return model;
}

}  // namespace brainshift::client
