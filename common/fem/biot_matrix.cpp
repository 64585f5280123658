// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/biot_matrix.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/core/units.hpp"

namespace brainshift::fem {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

using Triplets = std::vector<Eigen::Triplet<double, int>>;
using RowMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;

// G by rows (displacement unknowns) and the lower triangle of dt H + M + P by columns.
struct PressureBlocks {
  RowMatrix coupling;
  Eigen::SparseMatrix<double, Eigen::ColMajor, int> pressure;
  int stabilised_tets = 0;
};

PressureBlocks pressure_blocks(const TetMesh& mesh, const MaterialMap& materials,
                               const DofMap& dofs, const PressureMap& pressure, double dt_s,
                               bool stabilise) {
  PressureBlocks blocks;
  Triplets coupling, lower;
  coupling.reserve(static_cast<std::size_t>(mesh.num_tets()) * 48);
  lower.reserve(static_cast<std::size_t>(mesh.num_tets()) * 10);
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const BiotElement element =
        biot_element(tet_geometry(mesh, t), materials.at(t), dt_s, stabilise);
    if (element.stabilisation(0, 0) > 0.0) ++blocks.stabilised_tets;
    const Eigen::Matrix4d pp = dt_s * element.diffusion + element.storage + element.stabilisation;
    for (int j = 0; j < 4; ++j) {
      const int column = pressure.unknown[static_cast<std::size_t>(mesh.tets(j, t))];
      if (column < 0) continue;
      for (int i = 0; i < 4; ++i) {
        const NodeIndex node = mesh.tets(i, t);
        const int row = pressure.unknown[static_cast<std::size_t>(node)];
        if (row >= column) lower.emplace_back(row, column, pp(i, j));
        Vec3 local = element.coupling.col(i);
        if (!dofs.has_identity_frame(node)) local = dofs.frame(node).transpose() * local;
        for (int axis = 0; axis < 3; ++axis) {
          const int unknown = dofs.unknown(node, axis);
          if (unknown >= 0) coupling.emplace_back(unknown, column, local[axis]);
        }
      }
    }
  }
  blocks.coupling.resize(dofs.num_unknowns(), pressure.num_unknowns);
  blocks.coupling.setFromTriplets(coupling.begin(), coupling.end());
  blocks.pressure.resize(pressure.num_unknowns, pressure.num_unknowns);
  blocks.pressure.setFromTriplets(lower.begin(), lower.end());
  return blocks;
}

}  // namespace

PressureMap::PressureMap(int num_nodes, const std::vector<NodeIndex>& drained)
    : unknown(static_cast<std::size_t>(num_nodes), 0) {
  for (const NodeIndex node : drained) unknown[static_cast<std::size_t>(node)] = -1;
  for (int& index : unknown) {
    if (index == 0) index = num_unknowns++;
  }
}

double consolidation_coefficient(const PoroMaterial& material) {
  const double alpha = material.biot_coefficient;
  const double capacity =
      material.storage + alpha * alpha / (material.elastic.lambda + 2.0 * material.elastic.shear);
  return material.permeability > 0.0 ? material.permeability / capacity : 0.0;
}

double vermeer_verruijt_step_s(const PoroMaterial& material, double volume_mm3) {
  const double h = std::cbrt(6.0 * std::sqrt(2.0) * volume_mm3);
  const double c_v = consolidation_coefficient(material);
  return c_v > 0.0 ? h * h / (6.0 * c_v) : kInfinite;
}

BiotElement biot_element(const TetGeometry& geometry, const PoroMaterial& material, double dt_s,
                         bool stabilise) {
  const double volume = geometry.volume;
  const double alpha = material.biot_coefficient;
  const Eigen::Matrix4d ones = Eigen::Matrix4d::Ones();
  const Eigen::Matrix4d mass = volume / 20.0 * (ones + Eigen::Matrix4d::Identity());
  BiotElement element;
  element.diffusion =
      material.permeability * volume * geometry.gradients.transpose() * geometry.gradients;
  element.storage = material.storage * mass;
  element.coupling = alpha * volume / 4.0 * geometry.gradients;
  const double bound = vermeer_verruijt_step_s(material, volume);
  const double theta = stabilise ? std::max(0.0, 1.0 - dt_s / bound) : 0.0;
  element.stabilisation =
      theta * alpha * alpha / (2.0 * material.elastic.shear) * (mass - volume / 16.0 * ones);
  return element;
}

BiotMatrix assemble_biot(const TetMesh& mesh, const MaterialMap& materials, const DofMap& dofs,
                         const PressureMap& pressure, double dt_s, bool stabilise) {
  const linalg::SymmetricMatrix stiffness = assemble_stiffness(mesh, materials.elastic(), dofs);
  const PressureBlocks blocks = pressure_blocks(mesh, materials, dofs, pressure, dt_s, stabilise);
  BiotMatrix matrix;
  matrix.displacement_unknowns = dofs.num_unknowns();
  matrix.pressure_unknowns = pressure.num_unknowns;
  matrix.stabilised_tets = blocks.stabilised_tets;
  const long nu = matrix.displacement_unknowns, np = matrix.pressure_unknowns;
  matrix.lower.resize(nu + np, nu + np);
  matrix.lower.resizeNonZeros(stiffness.nonZeros() + blocks.coupling.nonZeros() +
                              blocks.pressure.nonZeros());
  long* starts = matrix.lower.outerIndexPtr();
  long* rows = matrix.lower.innerIndexPtr();
  double* values = matrix.lower.valuePtr();
  long next = 0;
  for (long j = 0; j < nu; ++j) {
    starts[j] = next;
    for (linalg::SymmetricMatrix::InnerIterator it(stiffness, j); it; ++it) {
      rows[next] = it.row();
      values[next++] = it.value();
    }
    for (RowMatrix::InnerIterator it(blocks.coupling, j); it; ++it) {
      rows[next] = nu + it.col();
      values[next++] = -it.value();
    }
  }
  for (long j = 0; j < np; ++j) {
    starts[nu + j] = next;
    for (decltype(blocks.pressure)::InnerIterator it(blocks.pressure, j); it; ++it) {
      rows[next] = nu + it.row();
      values[next++] = -it.value();
    }
  }
  starts[nu + np] = next;
  return matrix;
}

void replace_stiffness(BiotMatrix& matrix, const linalg::SymmetricMatrix& stiffness) {
  assert(stiffness.rows() == matrix.displacement_unknowns);
  for (long j = 0; j < stiffness.outerSize(); ++j) {
    const long count = stiffness.outerIndexPtr()[j + 1] - stiffness.outerIndexPtr()[j];
    std::copy_n(stiffness.valuePtr() + stiffness.outerIndexPtr()[j], count,
                matrix.lower.valuePtr() + matrix.lower.outerIndexPtr()[j]);
  }
}

}  // namespace brainshift::fem
