// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/elasticity.hpp"

#include <algorithm>
#include <cassert>
#include <vector>

#include "common/core/units.hpp"

namespace brainshift::fem {
namespace {

// For every node the sorted nodes that share a tetrahedron with it and are not smaller, itself included:
// the block pattern of the lower triangle, column by column.
std::vector<std::vector<int>> lower_adjacency(const TetMesh& mesh) {
  std::vector<std::vector<int>> neighbours(mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        if (mesh.tets(b, t) >= mesh.tets(a, t)) {
          neighbours[mesh.tets(a, t)].push_back(mesh.tets(b, t));
        }
      }
    }
  }
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return neighbours;
}

// Zero matrix with the pattern of the assembled lower triangle.
SymmetricMatrix lower_pattern(const std::vector<std::vector<int>>& neighbours, const DofMap& dofs) {
  const long n = dofs.num_unknowns();
  SymmetricMatrix matrix(n, n);
  std::vector<long> rows;
  std::vector<long> starts(1, 0);
  starts.reserve(static_cast<std::size_t>(n) + 1);
  for (int node = 0; node < dofs.num_nodes(); ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      const int column = dofs.unknown(node, axis);
      if (column < 0) continue;
      for (int other : neighbours[node]) {
        for (int k = 0; k < 3; ++k) {
          const int row = dofs.unknown(other, k);
          if (row >= column) rows.push_back(row);
        }
      }
      starts.push_back(static_cast<long>(rows.size()));
    }
  }
  matrix.resizeNonZeros(static_cast<long>(rows.size()));
  std::copy(starts.begin(), starts.end(), matrix.outerIndexPtr());
  std::copy(rows.begin(), rows.end(), matrix.innerIndexPtr());
  std::fill_n(matrix.valuePtr(), rows.size(), 0.0);
  return matrix;
}

// Adds the 3 x 3 block of node pair (row node, column node), in local axes, to the lower triangle.
// Unknowns of one node are consecutive, so one binary search per column finds all of the block's rows.
void scatter(SymmetricMatrix& lower, const DofMap& dofs, int row_node, int column_node,
             const Mat3& block) {
  const long* rows = lower.innerIndexPtr();
  for (int b = 0; b < 3; ++b) {
    const int column = dofs.unknown(column_node, b);
    if (column < 0) continue;
    const long* first = rows + lower.outerIndexPtr()[column];
    const long* last = rows + lower.outerIndexPtr()[column + 1];
    for (int a = 0; a < 3; ++a) {
      const int row = dofs.unknown(row_node, a);
      if (row < column) continue;
      first = std::lower_bound(first, last, static_cast<long>(row));
      assert(first != last && *first == row);
      lower.valuePtr()[first - rows] += block(a, b);
    }
  }
}

}  // namespace

Elasticity elasticity_from(const Material& material) {
  const double shear = units::stress_from_pa(material.shear_modulus_pa);
  const double nu = material.poisson_ratio;
  return {2.0 * shear * nu / (1.0 - 2.0 * nu), shear};
}

TetGeometry tet_geometry(const TetMesh& mesh, int tet) {
  const Vec3 x0 = mesh.nodes.col(mesh.tets(0, tet));
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = mesh.nodes.col(mesh.tets(k + 1, tet)) - x0;
  TetGeometry geometry;
  geometry.volume = edges.determinant() / 6.0;
  geometry.gradients.rightCols<3>() = edges.inverse().transpose();
  geometry.gradients.col(0) = -geometry.gradients.rightCols<3>().rowwise().sum();
  return geometry;
}

SymmetricMatrix assemble_stiffness(const TetMesh& mesh, const Elasticity& material,
                                   const DofMap& dofs) {
  return assemble_stiffness(
      mesh, std::vector<Elasticity>(static_cast<std::size_t>(mesh.num_tets()), material), dofs);
}

SymmetricMatrix assemble_stiffness(const TetMesh& mesh, const std::vector<Elasticity>& of_tet,
                                   const DofMap& dofs) {
  assert(of_tet.size() == static_cast<std::size_t>(mesh.num_tets()));
  SymmetricMatrix lower = lower_pattern(lower_adjacency(mesh), dofs);
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const TetGeometry geometry = tet_geometry(mesh, t);
    const Elasticity& material = of_tet[static_cast<std::size_t>(t)];
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const int row_node = mesh.tets(i, t);
        const int column_node = mesh.tets(j, t);
        if (row_node < column_node) continue;
        const Vec3 gi = geometry.gradients.col(i);
        const Vec3 gj = geometry.gradients.col(j);
        Mat3 block = material.lambda * gi * gj.transpose() + material.shear * gj * gi.transpose() +
                     material.shear * gi.dot(gj) * Mat3::Identity();
        block *= geometry.volume;
        if (!dofs.has_identity_frame(row_node)) block = dofs.frame(row_node).transpose() * block;
        if (!dofs.has_identity_frame(column_node)) block = block * dofs.frame(column_node);
        scatter(lower, dofs, row_node, column_node, block);
      }
    }
  }
  return lower;
}

void add_to_node_block(SymmetricMatrix& lower, const DofMap& dofs, NodeIndex node,
                       const Mat3& block) {
  assert(dofs.has_identity_frame(node));
  scatter(lower, dofs, node, node, block);
}

VecX multiply(const SymmetricMatrix& lower, const VecX& x) {
  return lower.selfadjointView<Eigen::Lower>() * x;
}

VecX nodal_volumes(const TetMesh& mesh) {
  VecX volumes = VecX::Zero(mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const double quarter = tet_geometry(mesh, t).volume / 4.0;
    for (int k = 0; k < 4; ++k) volumes[mesh.tets(k, t)] += quarter;
  }
  return volumes;
}

}  // namespace brainshift::fem
