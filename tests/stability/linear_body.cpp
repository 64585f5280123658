// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/linear_body.hpp"

#include "common/values/case_config.hpp"
#include "common/linalg/checked_solve.hpp"
#include "common/fem/deformation.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "tests/stability/toy_problem.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::stability {
namespace {

constexpr double kSize_mm = 60.0;
constexpr double kMove_mm = 5.0;

// What the product makes of the body: matrix, factor, checked solve.
Result<Points> answer(const LinearBody& body, const linalg::SymmetricMatrix& matrix,
                      const Points& load, Point& point) {
  if (auto status = geometry::check_mesh(body.mesh); !status) {
    return tl::unexpected(status.error());
  }
  const auto factor = linalg::SparseCholesky::factorise(matrix);
  if (!factor) return tl::unexpected(factor.error());
  point.rcond = factor->rcond();
  VecX x;
  const auto quality =
      linalg::checked_solve(matrix, linalg::max_norm(matrix), *factor, body.dofs.restrict_to(load), x);
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

void solve_linear(const LinearBody& body, Point point, const Options& options) {
  point.unit = "relative";
  const bool uniform = body.materials.size() == 1;
  MatrixR full = reference_stiffness(body.mesh, body.materials, body.dofs);
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
  Reference reference(std::move(full), body.dofs, nullptr);
  VectorR right = reference.displacement(load);
  const double scale = kMove_mm / static_cast<double>(right.cwiseAbs().maxCoeff());
  if (std::isfinite(scale) && scale > 0.0) {
    load *= scale;
    right = reference.displacement(load);
  }
  auto u = answer(body, matrix, load, point);
  if (!u) {
    set_refused(u.error(), point);
    return options.record(point);
  }
  point.answered = true;
  point.status = "solved";
  if (options.faults != nullptr) options.faults->field(*u, point);
  point.min_volume_ratio = fem::measure_deformation(body.mesh, *u).min_volume_ratio;
  point.difference = relative_difference(*u, right);
  point.bound = rounding_bound(reference.condition());
  options.record(point);
}

}  // namespace brainshift::stability
