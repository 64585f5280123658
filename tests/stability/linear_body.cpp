// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/linear_body.hpp"

#include <cmath>

#include "common/configuration/case_config.hpp"
#include "common/fem/deformation.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/linalg/checked_solve.hpp"
#include "tests/stability/toy_problem.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::stability {
namespace {

constexpr double kSize_mm = 60.0;
constexpr double kMove_mm = 5.0;

// The product's side: mesh check, factor, checked solve.
Result<Points> answer(const LinearBody& body, const linalg::SymmetricMatrix& matrix,
                      const Points& load, Point& point) {
  if (auto status = geometry::check_mesh(body.mesh); !status) return tl::unexpected(status.error());
  const auto factor = linalg::SparseCholesky::factorise(matrix);
  if (!factor) return tl::unexpected(factor.error());
  point.rcond = factor->rcond();
  VecX x;
  const auto quality = linalg::checked_solve(matrix, linalg::max_norm(matrix), *factor,
                                             body.dofs.restrict_to(load), x);
  if (!quality) return tl::unexpected(quality.error());
  point.backward_error = quality->backward_error;
  point.iterations = 1 + quality->refinements;
  return body.dofs.expand(x);
}

}  // namespace

LinearBody standing_block(int cells) {
  LinearBody body;
  body.mesh = test_support::box_mesh(cells, cells, cells, Vec3::Constant(kSize_mm));
  body.materials = {fem::elasticity_from(Material{})};
  body.dofs = fem::DofMap(body.mesh.num_nodes());
  for (const NodeIndex node :
       test_support::nodes_where(body.mesh, [](const Vec3& x) { return x[2] == 0.0; })) {
    body.dofs.fix_all(node);
  }
  body.dofs.finalise();
  return body;
}

void flip_one_sign(linalg::SymmetricMatrix& lower) {
  const VecX diagonal = lower.diagonal();
  double* chosen = nullptr;
  double least = 1.0;
  for (Eigen::Index j = 0; j < lower.outerSize(); ++j) {
    for (linalg::SymmetricMatrix::InnerIterator it(lower, j); it; ++it) {
      if (it.row() == it.col()) continue;
      const double share =
          std::abs(it.value()) / std::sqrt(std::abs(diagonal[it.row()] * diagonal[it.col()]));
      if (share < 1e-3 || share >= least) continue;
      least = share;
      chosen = &it.valueRef();
    }
  }
  if (chosen != nullptr) *chosen = -*chosen;
}

Vec3 turned(const Vec3& vector) {
  constexpr double kTurn_rad = 0.2;
  return Eigen::AngleAxisd(kTurn_rad, vector.unitOrthogonal()) * vector;
}

void turn_one_force(Points& load) {
  Eigen::Index node = 0;
  load.colwise().norm().maxCoeff(&node);
  load.col(node) = turned(load.col(node));
}

void solve_linear(const LinearBody& body, Point point, const Options& options) {
  point.unit = "relative";
  const bool uniform = body.materials.size() == 1;
  const Unknowns unknowns = unknowns_of(body.dofs);
  MatrixR full = reference_stiffness(body.mesh, body.materials, unknowns);
  linalg::SymmetricMatrix matrix =
      uniform ? fem::assemble_stiffness(body.mesh, body.materials.front(), body.dofs)
              : lower_triangle(full);
  for (const auto& [node, stiffness] : body.springs) {
    fem::add_to_node_block(matrix, body.dofs, node, stiffness * Mat3::Identity());
    for (int axis = 0; axis < 3; ++axis) {
      const int k = body.dofs.unknown(node, axis);
      full(k, k) += static_cast<Real>(stiffness);
    }
  }
  Points load(3, body.mesh.num_nodes());
  const VecX volumes = fem::nodal_volumes(body.mesh);
  for (Eigen::Index i = 0; i < load.cols(); ++i) {
    load.col(i) = 1e-8 * volumes[i] * Vec3(1.0, 0.3, -0.5);
  }
  const Reference reference(std::move(full), unknowns);
  VectorR right = reference.displacement(load);
  const double scale = kMove_mm / static_cast<double>(right.cwiseAbs().maxCoeff());
  if (std::isfinite(scale) && scale > 0.0) {
    load *= scale;
    right = reference.displacement(load);
  }
  Points given = load;
  if (options.fault == Fault::kSign) flip_one_sign(matrix);
  if (options.fault == Fault::kNormal) turn_one_force(given);
  if (options.fault == Fault::kScale) matrix *= 1.01;
  const auto u = answer(body, matrix, given, point);
  if (!u) return options.record_refused(u.error(), point);
  point.answered = true;
  point.status = "solved";
  point.min_volume_ratio = fem::measure_deformation(body.mesh, *u).min_volume_ratio;
  point.difference = relative_difference(*u, right);
  point.bound = rounding_bound(reference.condition());
  options.record(point);
}

}  // namespace brainshift::stability
