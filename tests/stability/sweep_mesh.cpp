// SPDX-License-Identifier: GPL-3.0-or-later
// Bad elements: one node pressed into the face opposite (slivers) or into a neighbour (needles),
// and layers whose thickness jumps.
#include <cmath>

#include "tests/stability/linear_body.hpp"

namespace brainshift::stability {
namespace {

constexpr int kMeshCells = 4;

NodeIndex node_at(int i, int j, int k) { return i + (kMeshCells + 1) * (j + (kMeshCells + 1) * k); }

// The star of an interior node of Kuhn's mesh is convex, so a node that moves to a point of its
// boundary flattens the elements there and inverts none.
LinearBody pressed(const Vec3& towards, double part_left) {
  LinearBody body = standing_block(kMeshCells);
  auto x = body.mesh.nodes.col(node_at(2, 2, 2));
  x = (towards + part_left * (x - towards)).eval();
  return body;
}

Vec3 opposite_face_centre() {
  const LinearBody body = standing_block(kMeshCells);
  const NodeIndex centre = node_at(2, 2, 2);
  for (int t = 0; t < body.mesh.num_tets(); ++t) {
    Vec3 sum = Vec3::Zero();
    bool holds = false;
    for (int k = 0; k < 4; ++k) {
      if (body.mesh.tets(k, t) == centre) {
        holds = true;
      } else {
        sum += body.mesh.nodes.col(body.mesh.tets(k, t)) / 3.0;
      }
    }
    if (holds) return sum;
  }
  return Vec3::Zero();
}

void flat_elements(const Options& options) {
  const LinearBody body = standing_block(kMeshCells);
  const Vec3 face = opposite_face_centre(), neighbour = body.mesh.nodes.col(node_at(3, 2, 2));
  for (const double left : thinned(decades(-12, 0), options.grid)) {
    Point point;
    point.sheet = "mesh";
    point.parameter = "height (sliver) or edge (needle) over mesh size";
    point.x = left;
    point.row = "one solve: slivers";
    solve_linear(pressed(face, left), point, options);
    point.row = "one solve: needles";
    solve_linear(pressed(neighbour, left), point, options);
  }
}

void size_jumps(const Options& options) {
  for (const double ratio : thinned(decades(0, 10), options.grid)) {
    LinearBody body = standing_block(kMeshCells);
    // Thick and thin layers in turn along x, 60 mm in all.
    std::vector<double> border = {0.0};
    for (int i = 0; i < kMeshCells; ++i)
      border.push_back(border.back() + (i % 2 == 0 ? ratio : 1.0));
    for (NodeIndex n = 0; n < body.mesh.num_nodes(); ++n) {
      body.mesh.nodes(0, n) =
          60.0 * border[static_cast<std::size_t>(n % (kMeshCells + 1))] / border.back();
    }
    Point point;
    point.sheet = "mesh";
    point.parameter = "thickness of neighbouring layers, ratio";
    point.x = ratio;
    point.row = "one solve: layers";
    solve_linear(body, point, options);
  }
}

}  // namespace

void sweep_mesh(const Options& options) {
  flat_elements(options);
  size_jumps(options);
}

}  // namespace brainshift::stability
