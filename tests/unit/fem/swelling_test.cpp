// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/swelling.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/fem/space_elasticity.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::fem {
namespace {

// A free body that swells by theta everywhere takes u = theta / 3 x without stress from
// elasticity: its internal force K u equals the load.
TEST(Swelling, StretchesAFreeBodyByAThirdOfItsStrainInEveryDirection) {
  const TetMesh mesh = test_support::box_mesh(Vec3(-5, 0, 2), Vec3(7, 9, 12), 3, 0.15);
  const Material material;
  const double theta = 0.06;
  const Points load = swelling_load(mesh, material, [theta](const Vec3&) { return theta; });
  const auto materials = MaterialMap::uniform(poro_material_from(material), mesh.num_tets());
  const Points force =
      internal_force(make_space(mesh, Element::kP1), materials, theta / 3.0 * mesh.nodes);
  ASSERT_GT(load.norm(), 0.0);
  EXPECT_LT((force - load).norm(), 1e-13 * load.norm());
}

// The same on linear and on quadratic elements, whose loads come from quadrature.
TEST(Swelling, StretchesLinearAndQuadraticElementsAlike) {
  const TetMesh mesh = test_support::box_mesh(Vec3(-5, 0, 2), Vec3(7, 9, 12), 3, 0.15);
  const Material material;
  const double theta = 0.06;
  const auto materials = MaterialMap::uniform(poro_material_from(material), mesh.num_tets());
  for (const Element element : {Element::kP1, Element::kP2}) {
    const DisplacementSpace space = make_space(mesh, element);
    const Points load = swelling_load(space, material, [theta](const Vec3&) { return theta; });
    const Points force = internal_force(space, materials, theta / 3.0 * space.nodes);
    ASSERT_GT(load.norm(), 0.0);
    EXPECT_LT((force - load).norm(), 1e-12 * load.norm());
  }
}

// Of any strain the forces balance, and so do their moments.
TEST(Swelling, LoadsBalance) {
  const TetMesh mesh = test_support::box_mesh(Vec3(-5, 0, 2), Vec3(7, 9, 12), 3, 0.15);
  const Points load = swelling_load(
      mesh, Material{}, [](const Vec3& x) { return 0.1 * std::exp(-0.02 * x.squaredNorm()); });
  Vec3 moment = Vec3::Zero();
  double arms = 0.0;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    moment += Vec3(mesh.nodes.col(n)).cross(Vec3(load.col(n)));
    arms += mesh.nodes.col(n).norm() * load.col(n).norm();
  }
  ASSERT_GT(arms, 0.0);
  EXPECT_LT(load.rowwise().sum().norm(), 1e-13 * load.colwise().norm().sum());
  EXPECT_LT(moment.norm(), 1e-13 * arms);
}

}  // namespace
}  // namespace brainshift::fem
