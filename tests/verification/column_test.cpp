// SPDX-License-Identifier: GPL-3.0-or-later
// A column under its own weight, bottom fixed, top free. With nu = 0 there is no lateral strain,
// so the free column and a confined one coincide and the closed form is one-dimensional (E = 2 G,
// height H, weight density f):
//   u_z(z) = -f / E (H z - z^2 / 2),   sag of the top f H^2 / (2 E)
#include <gtest/gtest.h>

#include <cmath>

#include "common/configuration/case_config.hpp"
#include "common/core/units.hpp"
#include "common/fem/body_loads.hpp"
#include "common/fem/elasticity.hpp"
#include "common/linalg/cholesky.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::fem {
namespace {

constexpr double kColumnHeight = 60.0, kWidth = 60.0;

// Largest error over the nodes, relative to the sag of the top.
double column_error(int cells) {
  const TetMesh mesh =
      test_support::box_mesh(cells, cells, cells, Vec3(kWidth, kWidth, kColumnHeight));
  DofMap dofs(mesh.num_nodes());
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    if (mesh.nodes(2, n) == 0.0) dofs.fix_all(n);
  }
  dofs.finalise();
  Material material;
  material.poisson_ratio = 0.0;
  const Elasticity tissue = elasticity_from(material);
  const Vec3 down(0, 0, -1);
  const Points weight =
      buoyancy_load(mesh, material, down, 1.0, down);  // plane below the floor: all drained
  const auto factor = linalg::SparseCholesky::factorise(assemble_stiffness(mesh, tissue, dofs));
  EXPECT_TRUE(factor.has_value());
  const Points u = dofs.expand(factor->solve(dofs.restrict_to(weight)));

  const double density = units::weight_density_from_kg_m3(999.0);
  const double youngs = 2.0 * tissue.shear;
  double error = 0.0;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const double z = mesh.nodes(2, n);
    const Vec3 exact(0, 0, -density / youngs * (kColumnHeight * z - z * z / 2.0));
    error = std::max(error, (u.col(n) - exact).norm());
  }
  error /= density * kColumnHeight * kColumnHeight / (2.0 * youngs);
  test_support::record(
      {"gravity-column", "P1", "element size mm", "error %", kColumnHeight / cells, 100.0 * error});
  return error;
}

TEST(GravityColumn, SagConvergesToTheClosedForm) {
  const double coarse = column_error(6);
  const double fine = column_error(12);
  ASSERT_GT(fine, 1e-8);  // not exact by accident, so that the order means something
  // Largest nodal error on edges of H / 12; order 1.7 on the way to 2, because the one-sided
  // diagonals of the mesh bend the column a little.
  constexpr char kSource[] = "u = -f (H z - z^2/2) / E";
  const double order = std::log2(coarse / fine);
  EXPECT_TRUE(test_support::record_check("gravity-column", "P1 error %", 100.0 * fine, "<= 3",
                                         fine <= 0.03, kSource));
  EXPECT_TRUE(test_support::record_check("gravity-column", "P1 order", order, ">= 1.6",
                                         order >= 1.6, kSource));
}

}  // namespace
}  // namespace brainshift::fem
