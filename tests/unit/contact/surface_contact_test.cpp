// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/surface_contact.hpp"

#include <gtest/gtest.h>

#include "common/fem/elasticity.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::contact {
namespace {

TriangleSurface floor_triangles(double height) {
  TriangleSurface surface;
  surface.vertices.resize(3, 4);
  surface.vertices << -50, 50, 50, -50, -50, -50, 50, 50, height, height, height, height;
  surface.triangles.resize(3, 2);
  surface.triangles << 0, 0, 1, 2, 2, 3;  // seen from above counter-clockwise: looks up
  return surface;
}

TEST(Obstacle, PlaneSphereAndSurfaceAgreeOnPenetration) {
  Points points(3, 2);
  points << 0.3, 1.0, 0.4, -2.0, 1.5, -0.5;
  const auto plane = contact_pairs(points, RigidPlane{Vec3(7, 8, 0.5), Vec3::UnitZ()});
  const auto surface = contact_pairs(points, RigidSurface{floor_triangles(0.5)});
  const auto sphere = contact_pairs(points, RigidSphere{Vec3(0, 0, -1e6), 1e6 + 0.5});
  ASSERT_TRUE(plane && surface && sphere);
  EXPECT_DOUBLE_EQ((*plane)[0].initial_penetration_mm, -1.0);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR((*surface)[i].initial_penetration_mm, (*plane)[i].initial_penetration_mm, 1e-12);
    EXPECT_NEAR((*sphere)[i].initial_penetration_mm, (*plane)[i].initial_penetration_mm, 1e-5);
    EXPECT_LT(((*surface)[i].normal - Vec3::UnitZ()).norm(), 1e-12);
  }
}

TEST(Obstacle, APointInTheCentreOfTheBallIsRejected) {
  EXPECT_FALSE(contact_pairs(Points::Zero(3, 1), RigidSphere{Vec3::Zero(), 1.0}));
}

// E(u) = 1/2 sum k <P>^2: its gradient is minus the force, its Hessian the stiffness.
TEST(SurfaceContact, ForceAndStiffnessAreDerivativesOfTheEnergy) {
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    const auto space =
        fem::make_space(test_support::box_mesh(2, 2, 2, Vec3::Constant(4.0)), element);
    SurfaceContact contact(space);
    ASSERT_TRUE(contact.add(geometry::boundary_triangles(space.mesh),
                            RigidSphere{Vec3(2.0, 2.0, -9.0), 9.5}, 3.0));
    const auto energy = [&](const Points& u) {
      const VecX p = contact.penetration(u).cwiseMax(0.0);
      double sum = 0.0;
      for (int i = 0; i < contact.num_points(); ++i) {
        sum += 0.5 * contact.points()[static_cast<std::size_t>(i)].stiffness * p[i] * p[i];
      }
      return sum;
    };
    std::srand(3);
    const Points u = 0.01 * Points::Random(3, space.num_nodes());
    const Points d = 1e-3 * Points::Random(3, space.num_nodes());
    const VecX p = contact.penetration(u);
    ActiveSet active(static_cast<std::size_t>(contact.num_points()));
    for (std::size_t i = 0; i < active.size(); ++i)
      active[i] = p[static_cast<Eigen::Index>(i)] > 0.0;
    ASSERT_GT(count(active), 3);
    Points force = Points::Zero(3, space.num_nodes());
    contact.add_force(p, active, force);
    const double slope = (energy(u + 1e-3 * d) - energy(u - 1e-3 * d)) / 2e-3;
    ASSERT_GT(std::abs(slope), 1e-9);
    EXPECT_NEAR(slope, -force.cwiseProduct(d).sum(), 1e-6 * std::abs(slope));

    fem::DofMap dofs(space.num_nodes());
    dofs.finalise();
    linalg::SymmetricMatrix k = fem::lower_pattern(space.elements, dofs);
    contact.add_stiffness(k, dofs, active);
    const VecX q = dofs.restrict_to(d);
    double expected = 0.0;
    const VecX approach = contact.approach(d);
    for (std::size_t i = 0; i < active.size(); ++i) {
      const double a = approach[static_cast<Eigen::Index>(i)];
      if (active[i]) expected += contact.points()[i].stiffness * a * a;
    }
    ASSERT_GT(expected, 0.0);
    EXPECT_NEAR(q.dot(linalg::multiply(k, q)), expected, 1e-12 * expected);
  }
}

}  // namespace
}  // namespace brainshift::contact
