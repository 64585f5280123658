// SPDX-License-Identifier: GPL-3.0-or-later
// A box of tetrahedra as test model: nodes on a regular lattice, six tetrahedra per cell (Kuhn).
#pragma once

#include <array>
#include <vector>

#include "common/values/brain_model.hpp"

namespace brainshift::test {

struct Box {
  int cells = 4;
  double edge_mm = 10.0;

  int index(int i, int j, int k) const { return i + (cells + 1) * (j + (cells + 1) * k); }

  TetMesh mesh() const {
    const int n = cells + 1;
    TetMesh mesh;
    mesh.nodes.resize(3, n * n * n);
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i)
          mesh.nodes.col(index(i, j, k)) = Vec3(i, j, k) * (edge_mm / cells);
      }
    }
    // The six orders of walking along the three axes from one corner of a cell to the opposite one.
    constexpr std::array<std::array<int, 3>, 6> kOrders = {
        {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
    mesh.tets.resize(4, 6 * cells * cells * cells);
    int t = 0;
    for (int k = 0; k < cells; ++k) {
      for (int j = 0; j < cells; ++j) {
        for (int i = 0; i < cells; ++i) {
          for (std::size_t o = 0; o < kOrders.size(); ++o) {
            std::array<int, 3> at = {i, j, k};
            Eigen::Vector4i tet;
            tet(0) = index(at[0], at[1], at[2]);
            for (int step = 0; step < 3; ++step) {
              ++at[static_cast<std::size_t>(kOrders[o][static_cast<std::size_t>(step)])];
              tet(step + 1) = index(at[0], at[1], at[2]);
            }
            if (o >= 3) std::swap(tet(2), tet(3));  // odd permutations are inverted
            mesh.tets.col(t++) = tet;
          }
        }
      }
    }
    return mesh;
  }

  // Nodes of the top face (largest z) that do not lie on its rim.
  std::vector<NodeIndex> top() const {
    std::vector<NodeIndex> nodes;
    for (int j = 1; j < cells; ++j) {
      for (int i = 1; i < cells; ++i) nodes.push_back(index(i, j, cells));
    }
    return nodes;
  }

  BrainModel model() const {
    BrainModel model;
    model.case_id = "box";
    model.model_id = "0123456789abcdef";
    model.mesh = mesh();
    model.craniotomy = top();
    model.gravity_direction = Vec3(0, 0, -1);
    return model;
  }
};

}  // namespace brainshift::test
