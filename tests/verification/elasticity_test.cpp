// SPDX-License-Identifier: GPL-3.0-or-later
// A column under its own weight, bottom fixed, top free. With nu = 0 there is no lateral strain,
// so the free column and a confined one coincide and the closed form is one-dimensional (E = 2 G,
// height H, weight density f):
//   u_z(z) = -f / E (H z - z^2 / 2),   sag of the top f H^2 / (2 E)
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/configuration/case_config.hpp"
#include "common/core/units.hpp"
#include "common/fem/body_loads.hpp"
#include "common/fem/elasticity.hpp"
#include "common/fem/space_elasticity.hpp"
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

// Manufactured solution: u = (a, b, c) s(x) s(y) s(z) with s(t) = sin(pi t / L) on a cube, zero
// on its boundary. The body force that makes it exact, f = -(lambda + G) grad div u - G lap u,
// and the errors are integrated by a rule of degree five. With polynomials of degree p the L2
// error must fall with order p + 1, that of the gradient with p.

constexpr double kSize = 10.0;
constexpr double kWave = std::numbers::pi / kSize;
constexpr Elasticity kTissue{0.003, 0.0021};
const Vec3 kAmplitude(1.0, -0.5, 0.7);

Vec3 sines(const Vec3& x) { return (kWave * x).array().sin(); }
Vec3 cosines(const Vec3& x) { return (kWave * x).array().cos(); }

Vec3 exact_solution(const Vec3& x) { return kAmplitude * sines(x).prod(); }

// Gradient of s(x) s(y) s(z).
Vec3 bubble_gradient(const Vec3& x) {
  const Vec3 s = sines(x), c = cosines(x);
  return kWave * Vec3(c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]);
}

Mat3 bubble_hessian(const Vec3& x) {
  const Vec3 s = sines(x), c = cosines(x);
  Mat3 h;
  h << -s.prod(), c[0] * c[1] * s[2], c[0] * s[1] * c[2],  //
      c[0] * c[1] * s[2], -s.prod(), s[0] * c[1] * c[2],   //
      c[0] * s[1] * c[2], s[0] * c[1] * c[2], -s.prod();
  return kWave * kWave * h;
}

// u_i = a_i B: grad div u = H a, lap u = a tr H.
Vec3 body_force(const Vec3& x) {
  const Mat3 h = bubble_hessian(x);
  return -(kTissue.lambda + kTissue.shear) * h * kAmplitude -
         kTissue.shear * h.trace() * kAmplitude;
}

struct Errors {
  double l2 = 0.0, gradient = 0.0;
};

Errors errors_of(const DisplacementSpace& space, const Points& u) {
  Errors errors;
  for (int e = 0; e < space.num_elements(); ++e) {
    const double volume = tet_geometry(space.mesh, e).volume;
    for (const TetPoint& q : fine_tet_rule()) {
      Vec3 x = Vec3::Zero();
      for (int k = 0; k < 4; ++k) x += q.l[k] * space.mesh.nodes.col(space.mesh.tets(k, e));
      const Mat3 exact_gradient = kAmplitude * bubble_gradient(x).transpose();
      errors.l2 +=
          q.weight * volume * (displacement_at(space, u, e, q.l) - exact_solution(x)).squaredNorm();
      errors.gradient += q.weight * volume *
                         (displacement_gradient(space, u, e, q.l) - exact_gradient).squaredNorm();
    }
  }
  return {std::sqrt(errors.l2), std::sqrt(errors.gradient)};
}

Errors solve_on(Element element, int cells) {
  TetMesh mesh = test_support::box_mesh(cells, cells, cells, Vec3::Constant(kSize));
  test_support::perturb_interior(mesh, 0.1 * kSize / cells, 3);
  const DisplacementSpace space = make_space(mesh, element);
  DofMap dofs(space.num_nodes());
  for (int n = 0; n < space.num_nodes(); ++n) {
    const Vec3 x = space.nodes.col(n);
    if (x.minCoeff() == 0.0 || x.maxCoeff() == kSize) dofs.fix_all(n);
  }
  dofs.finalise();
  const auto materials = MaterialMap::uniform({kTissue}, space.num_elements());
  const auto factor = linalg::SparseCholesky::factorise(assemble_stiffness(space, materials, dofs));
  EXPECT_TRUE(factor.has_value());
  const Points load = body_load(space, VectorField(body_force));
  return errors_of(space, dofs.expand(factor->solve(dofs.restrict_to(load))));
}

void expect_orders(Element element, const std::vector<int>& sizes, double degree) {
  const std::string name = element == Element::kP1 ? "P1" : "P2";
  std::vector<Errors> errors;
  for (const int cells : sizes) {
    errors.push_back(solve_on(element, cells));
    const double h = kSize / cells;
    test_support::record(
        {"manufactured", name + " L2", "element size mm", "error", h, errors.back().l2});
    test_support::record({"manufactured", name + " gradient", "element size mm", "error", h,
                          errors.back().gradient});
  }
  const Errors& coarse = errors[errors.size() - 2];
  const Errors& fine = errors.back();
  ASSERT_GT(fine.l2, 0.0);
  const double steps = std::log(static_cast<double>(sizes.back()) / sizes[sizes.size() - 2]);
  const auto check = [&](const std::string& what, double ratio, double expected) {
    const double order = std::log(ratio) / steps;
    const std::string bound = std::to_string(expected - 0.25).substr(0, 4) + " to " +
                              std::to_string(expected + 0.3).substr(0, 3);
    const bool pass = order > expected - 0.25 && order < expected + 0.3;
    EXPECT_TRUE(test_support::record_check("manufactured", name + " order of the " + what, order,
                                           bound, pass, "Brenner and Scott 2008 ch. 5"))
        << order;
  };
  check("L2 error", coarse.l2 / fine.l2, degree + 1.0);
  check("gradient error", coarse.gradient / fine.gradient, degree);
}

TEST(ManufacturedSolution, LinearElementsHaveOrdersTwoAndOne) {
  expect_orders(Element::kP1, {4, 8, 16}, 1.0);
}

TEST(ManufacturedSolution, QuadraticElementsHaveOrdersThreeAndTwo) {
  expect_orders(Element::kP2, {3, 6, 9}, 2.0);
}

}  // namespace
}  // namespace brainshift::fem
