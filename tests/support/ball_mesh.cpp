// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/ball_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace brainshift::test_support {
namespace {

// Rows of points on the unit octant; equal angles along its borders. Vertex (i, j) lies in row i
// from the pole z.
struct Patch {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> triangles;
};

Patch octant_patch(int cells) {
  Patch patch;
  std::vector<int> first;
  for (int i = 0; i <= cells; ++i) {
    first.push_back(static_cast<int>(patch.points.size()));
    const double polar = 0.5 * std::numbers::pi * i / cells;
    for (int j = 0; j <= i; ++j) {
      const double azimuth = i == 0 ? 0.0 : 0.5 * std::numbers::pi * j / i;
      patch.points.emplace_back(j == i && i > 0 ? 0.0 : std::sin(polar) * std::cos(azimuth),
                                j == 0 ? 0.0 : std::sin(polar) * std::sin(azimuth),
                                i == cells ? 0.0 : std::cos(polar));
    }
  }
  for (int i = 0; i < cells; ++i) {
    const int upper = first[static_cast<std::size_t>(i)];
    const int lower = first[static_cast<std::size_t>(i) + 1];
    for (int j = 0; j <= i; ++j) patch.triangles.push_back({upper + j, lower + j, lower + j + 1});
    for (int j = 0; j < i; ++j)
      patch.triangles.push_back({upper + j, lower + j + 1, upper + j + 1});
  }
  return patch;
}

}  // namespace

TetMesh octant_mesh(const std::vector<double>& radii, int cells) {
  const Patch patch = octant_patch(cells);
  const bool full = radii.front() == 0.0;
  const auto per_shell = static_cast<int>(patch.points.size());
  // The centre of a full ball is one node, number 0.
  const auto index = [&](int shell, int p) {
    if (!full) return shell * per_shell + p;
    return shell == 0 ? 0 : 1 + (shell - 1) * per_shell + p;
  };
  const auto shells = static_cast<int>(radii.size());
  TetMesh mesh;
  mesh.nodes = Points::Zero(3, index(shells - 1, per_shell - 1) + 1);
  for (int s = 0; s < shells; ++s) {
    for (int p = 0; p < per_shell; ++p) {
      mesh.nodes.col(index(s, p)) =
          radii[static_cast<std::size_t>(s)] * patch.points[static_cast<std::size_t>(p)];
    }
  }
  std::vector<Eigen::Vector4i> tets;
  for (int s = 0; s + 1 < shells; ++s) {
    for (std::array<int, 3> t : patch.triangles) {
      // A prism in three tetrahedra along its walk from the lowest inner to the highest outer
      // node, so that neighbours cut their common quadrilaterals alike.
      std::sort(t.begin(), t.end());
      const auto in = [&](std::size_t k) { return index(s, t[k]); };
      const auto out = [&](std::size_t k) { return index(s + 1, t[k]); };
      if (s > 0 || !full) {
        tets.emplace_back(in(0), in(1), in(2), out(2));
        tets.emplace_back(in(0), in(1), out(1), out(2));
      }
      tets.emplace_back(in(0), out(0), out(1), out(2));
    }
  }
  mesh.tets.resize(4, static_cast<Eigen::Index>(tets.size()));
  for (std::size_t t = 0; t < tets.size(); ++t) {
    Eigen::Vector4i tet = tets[t];
    Mat3 edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = mesh.nodes.col(tet[k + 1]) - mesh.nodes.col(tet[0]);
    if (edges.determinant() < 0.0) std::swap(tet[2], tet[3]);
    mesh.tets.col(static_cast<Eigen::Index>(t)) = tet;
  }
  return mesh;
}

}  // namespace brainshift::test_support
