// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/elasticity.hpp"

#include <algorithm>
#include <cassert>

#include "common/core/units.hpp"

namespace brainshift::fem {
namespace {

// For every node the sorted nodes that share an element with it and are not smaller, itself
// included: the block pattern of the lower triangle, column by column.
std::vector<std::vector<int>> lower_adjacency(const Eigen::Ref<const Eigen::MatrixXi>& elements,
                                              int num_nodes) {
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(num_nodes));
  for (Eigen::Index e = 0; e < elements.cols(); ++e) {
    for (int a = 0; a < elements.rows(); ++a) {
      for (int b = 0; b < elements.rows(); ++b) {
        if (elements(b, e) >= elements(a, e)) neighbours[elements(a, e)].push_back(elements(b, e));
      }
    }
  }
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return neighbours;
}

// The block is in local axes.
// Unknowns of one node are consecutive, so one binary search per column finds all of the block's
// rows.
void scatter(linalg::SymmetricMatrix& lower, const DofMap& dofs, int row_node, int column_node,
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

linalg::SymmetricMatrix lower_pattern(const Eigen::Ref<const Eigen::MatrixXi>& elements,
                                      const DofMap& dofs) {
  const std::vector<std::vector<int>> neighbours = lower_adjacency(elements, dofs.num_nodes());
  const long n = dofs.num_unknowns();
  linalg::SymmetricMatrix matrix(n, n);
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

void add_block(linalg::SymmetricMatrix& lower, const DofMap& dofs, NodeIndex row_node,
               NodeIndex column_node, Mat3 block) {
  if (!dofs.has_identity_frame(row_node)) block = dofs.frame(row_node).transpose() * block;
  if (!dofs.has_identity_frame(column_node)) block = block * dofs.frame(column_node);
  scatter(lower, dofs, row_node, column_node, block);
}

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

linalg::SymmetricMatrix assemble_stiffness(const TetMesh& mesh, const Elasticity& material,
                                           const DofMap& dofs) {
  return assemble_stiffness(
      mesh, std::vector<Elasticity>(static_cast<std::size_t>(mesh.num_tets()), material), dofs);
}

linalg::SymmetricMatrix assemble_stiffness(const TetMesh& mesh,
                                           const std::vector<Elasticity>& of_tet,
                                           const DofMap& dofs) {
  assert(of_tet.size() == static_cast<std::size_t>(mesh.num_tets()));
  return assemble_lower(mesh.tets, dofs, [&](int tet) {
    const Elasticity& material = of_tet[static_cast<std::size_t>(tet)];
    return [&material, geometry = tet_geometry(mesh, tet)](int i, int j) {
      const Vec3 gi = geometry.gradients.col(i);
      const Vec3 gj = geometry.gradients.col(j);
      Mat3 block = material.lambda * gi * gj.transpose() + material.shear * gj * gi.transpose() +
                   material.shear * gi.dot(gj) * Mat3::Identity();
      block *= geometry.volume;
      return block;
    };
  });
}

void add_to_node_block(linalg::SymmetricMatrix& lower, const DofMap& dofs, NodeIndex node,
                       const Mat3& block) {
  assert(dofs.has_identity_frame(node));
  add_block(lower, dofs, node, node, block);
}

VecX nodal_volumes(const TetMesh& mesh) {
  VecX volumes = VecX::Zero(mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const double quarter = tet_geometry(mesh, t).volume / 4.0;
    for (int k = 0; k < 4; ++k) volumes[mesh.tets(k, t)] += quarter;
  }
  return volumes;
}

PoroMaterial poro_material_from(const Material& material) {
  PoroMaterial poro;
  poro.elastic = elasticity_from(material);
  poro.biot_coefficient = material.biot_coefficient;
  poro.storage = units::storage_from_per_pa(material.storage_per_pa);
  poro.permeability = units::permeability_from_m3_s_kg(material.permeability_m3_s_kg);
  return poro;
}

}  // namespace brainshift::fem
