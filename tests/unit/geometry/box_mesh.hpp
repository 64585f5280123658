// SPDX-License-Identifier: GPL-3.0-or-later
// A box of tetrahedra, optionally with its inner nodes displaced; the tests' mesh with a known shape.
#pragma once

#include <array>
#include <random>

#include "common/core/mesh.hpp"

namespace brainshift::geometry::testing {

// cells^3 cubes of 6 tetrahedra each, filling the box [low, high]. Inner nodes move by up to
// `jitter` (< 0.2) of a cube's edges, so that the mesh is irregular inside and its boundary exact.
inline TetMesh box_mesh(const Vec3& low, const Vec3& high, int cells, double jitter = 0.0) {
  // Kuhn's division: one tetrahedron per order of walking along the axes from corner 0 to corner 7.
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}}};
  const int side = cells + 1;
  const Vec3 edge = (high - low) / cells;
  std::mt19937_64 random(7);
  const auto symmetric = [&] { return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0; };
  const auto inner = [&](int i) { return i > 0 && i < cells; };
  TetMesh mesh;
  mesh.nodes.resize(3, side * side * side);
  for (int k = 0, n = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i, ++n) {
        mesh.nodes.col(n) = low + edge.cwiseProduct(Vec3(i, j, k));
        const Vec3 shift(symmetric(), symmetric(), symmetric());
        if (inner(i) && inner(j) && inner(k))
          mesh.nodes.col(n) += jitter * edge.cwiseProduct(shift);
      }
  mesh.tets.resize(4, 6 * cells * cells * cells);
  int tet = 0;
  for (int k = 0; k < cells; ++k)
    for (int j = 0; j < cells; ++j)
      for (int i = 0; i < cells; ++i)
        for (std::size_t o = 0; o < kOrders.size(); ++o) {
          std::array<int, 3> at{i, j, k};
          const auto node = [&] { return at[0] + side * (at[1] + side * at[2]); };
          mesh.tets(0, tet) = node();
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(kOrders[o][step])];
            mesh.tets(static_cast<int>(step) + 1, tet) = node();
          }
          // The last three orders are odd permutations: their tetrahedra come out inverted.
          if (o >= 3) std::swap(mesh.tets(2, tet), mesh.tets(3, tet));
          ++tet;
        }
  return mesh;
}

}  // namespace brainshift::geometry::testing
