// SPDX-License-Identifier: GPL-3.0-or-later
// Manufactured solution: u = (a, b, c) s(x) s(y) s(z) with s(t) = sin(pi t / L) on a cube, zero on its boundary.
// The body force that makes it exact, f = -(lambda + G) grad div u - G lap u, is integrated against the shape
// functions by the four-point rule of degree two; the L2 error must fall with order 2, the energy error with 1.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/fem/cholesky.hpp"
#include "common/fem/elasticity.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::fem {
namespace {

constexpr double kSize = 10.0;
constexpr double kWave = std::numbers::pi / kSize;
constexpr Elasticity kTissue{0.003, 0.0021};
const Vec3 kAmplitude(1.0, -0.5, 0.7);

Vec3 sines(const Vec3& x) { return (kWave * x).array().sin(); }
Vec3 cosines(const Vec3& x) { return (kWave * x).array().cos(); }

Vec3 exact(const Vec3& x) { return kAmplitude * sines(x).prod(); }

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

// Barycentric points of the degree-two rule, equal weights 1/4.
constexpr double kNear = 0.5854101966249685, kFar = 0.1381966011250105;

struct Errors {
  double l2 = 0.0;
  double gradient = 0.0;
};

Errors solve_on(int cells) {
  TetMesh mesh = test_support::box_mesh(cells, cells, cells, Vec3::Constant(kSize));
  test_support::perturb_interior(mesh, 0.1 * kSize / cells, 3);
  DofMap dofs(mesh.num_nodes());
  const auto on_boundary = [](const Vec3& x) {
    return x.minCoeff() == 0.0 || x.maxCoeff() == kSize;
  };
  for (NodeIndex n : test_support::nodes_where(mesh, on_boundary)) dofs.fix_all(n);
  dofs.finalise();

  const auto at_point = [&](int tet, int q) {
    Vec3 x = Vec3::Zero();
    for (int k = 0; k < 4; ++k) x += (k == q ? kNear : kFar) * mesh.nodes.col(mesh.tets(k, tet));
    return x;
  };
  Points load = Points::Zero(3, mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const double weight = tet_geometry(mesh, t).volume / 4.0;
    for (int q = 0; q < 4; ++q) {
      const Vec3 force = body_force(at_point(t, q));
      for (int k = 0; k < 4; ++k) {
        load.col(mesh.tets(k, t)) += weight * (k == q ? kNear : kFar) * force;
      }
    }
  }
  const auto factor = SparseCholesky::factorise(assemble_stiffness(mesh, kTissue, dofs));
  EXPECT_TRUE(factor.has_value());
  const Points u = dofs.expand(factor->solve(dofs.restrict_to(load)));

  Errors errors;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const TetGeometry geometry = tet_geometry(mesh, t);
    Mat3 gradient = Mat3::Zero();
    for (int k = 0; k < 4; ++k) {
      gradient += u.col(mesh.tets(k, t)) * geometry.gradients.col(k).transpose();
    }
    for (int q = 0; q < 4; ++q) {
      const Vec3 x = at_point(t, q);
      Vec3 value = Vec3::Zero();
      for (int k = 0; k < 4; ++k) value += (k == q ? kNear : kFar) * u.col(mesh.tets(k, t));
      errors.l2 += geometry.volume / 4.0 * (value - exact(x)).squaredNorm();
      errors.gradient += geometry.volume / 4.0 *
                         (gradient - kAmplitude * bubble_gradient(x).transpose()).squaredNorm();
    }
  }
  return {std::sqrt(errors.l2), std::sqrt(errors.gradient)};
}

TEST(ManufacturedSolution, L2ErrorHasOrderTwoAndGradientErrorOrderOne) {
  const Errors coarse = solve_on(6);
  const Errors fine = solve_on(12);
  ASSERT_GT(fine.l2, 0.0);
  EXPECT_GT(std::log2(coarse.l2 / fine.l2), 1.75);
  EXPECT_GT(std::log2(coarse.gradient / fine.gradient), 0.85);
  EXPECT_LT(std::log2(coarse.gradient / fine.gradient), 1.3);
}

}  // namespace
}  // namespace brainshift::fem
