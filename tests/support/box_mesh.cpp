// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/box_mesh.hpp"

#include <algorithm>
#include <array>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::test_support {

TetMesh box_mesh(int nx, int ny, int nz, const Vec3& size) {
  const auto index = [&](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  TetMesh mesh;
  mesh.nodes.resize(3, (nx + 1) * (ny + 1) * (nz + 1));
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        mesh.nodes.col(index(i, j, k)) = Vec3(size[0] * i / nx, size[1] * j / ny, size[2] * k / nz);
      }
    }
  }
  // Kuhn: one tetrahedron per order in which the three axes are walked from corner 000 to corner
  // 111.
  std::array<int, 3> axes = {0, 1, 2};
  std::vector<Eigen::Vector4i> tets;
  do {
    const bool even = (axes[0] + 1) % 3 == axes[1];
    for (int k = 0; k < nz; ++k) {
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          std::array<int, 3> corner = {i, j, k};
          Eigen::Vector4i tet;
          tet[0] = index(corner[0], corner[1], corner[2]);
          for (int step = 0; step < 3; ++step) {
            ++corner[static_cast<std::size_t>(axes[static_cast<std::size_t>(step)])];
            tet[step + 1] = index(corner[0], corner[1], corner[2]);
          }
          if (!even) std::swap(tet[2], tet[3]);
          tets.push_back(tet);
        }
      }
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  mesh.tets.resize(4, static_cast<Eigen::Index>(tets.size()));
  for (std::size_t t = 0; t < tets.size(); ++t)
    mesh.tets.col(static_cast<Eigen::Index>(t)) = tets[t];
  return mesh;
}

TetMesh box_mesh(const Vec3& low, const Vec3& high, int cells, double jitter) {
  TetMesh mesh = box_mesh(cells, cells, cells, high - low);
  mesh.nodes.colwise() += low;
  if (jitter > 0.0) perturb_interior(mesh, jitter * (high - low).minCoeff() / cells, 7);
  return mesh;
}

void perturb_interior(TetMesh& mesh, double amplitude, unsigned seed) {
  const auto boundary = geometry::boundary_triangles(mesh);
  std::vector<char> on_boundary(static_cast<std::size_t>(mesh.num_nodes()), 0);
  for (Eigen::Index i = 0; i < boundary.size(); ++i) {
    on_boundary[static_cast<std::size_t>(boundary.data()[i])] = 1;
  }
  Random random(seed);
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const Vec3 shift(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
    if (!on_boundary[static_cast<std::size_t>(n)]) mesh.nodes.col(n) += 2.0 * amplitude * shift;
  }
}

std::vector<NodeIndex> nodes_where(const TetMesh& mesh,
                                   const std::function<bool(const Vec3&)>& holds) {
  std::vector<NodeIndex> nodes;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    if (holds(mesh.nodes.col(n))) nodes.push_back(n);
  }
  return nodes;
}

}  // namespace brainshift::test_support
