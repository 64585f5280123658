// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/elasticity.hpp"

#include <cassert>
#include <vector>

#include "common/core/units.hpp"
#include "common/fem/assembly.hpp"

namespace brainshift::fem {
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

}  // namespace brainshift::fem
