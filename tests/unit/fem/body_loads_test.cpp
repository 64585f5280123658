// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/random.hpp"
#include "common/core/units.hpp"
#include "common/fem/body_loads.hpp"
#include "common/fem/space_elasticity.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::fem {
namespace {

using test_support::box_mesh;

const double kWeight = units::weight_density_from_kg_m3(999.0);  // N/mm^3, Table 1 above the plane

double sum_along(const Points& load, const Vec3& direction) {
  return direction.dot(Vec3(load.rowwise().sum()));
}

TEST(Buoyancy, TotalForceIsTheWeightOfTheDrainedPartWhereverThePlaneCuts) {
  const Vec3 size(30, 20, 40);
  const TetMesh mesh = box_mesh(3, 2, 4, size);
  const Vec3 down(0, 0, -1);
  for (double height_above : {0.0, 3.3, 10.0, 17.1, 40.0, 55.0}) {
    // Depth of a point is -z; the plane lies height_above below the top.
    const Points load = buoyancy_load(mesh, Material{}, down, -size[2] + height_above, down);
    const double drained = 30.0 * 20.0 * std::min(height_above, 40.0);
    EXPECT_NEAR(sum_along(load, down), kWeight * drained, 1e-12);
    EXPECT_NEAR(load.topRows<2>().norm(), 0.0, 1e-15);
  }
}

// Where no element is cut, the loads of linear elements are those of the mesh; of quadratic ones
// the sum is the same.
TEST(Buoyancy, OfASpaceIsThatOfItsMesh) {
  const Vec3 size(30, 20, 40);
  const Vec3 down(0, 0, -1);
  const TetMesh mesh = box_mesh(3, 2, 4, size);
  const Points known = buoyancy_load(mesh, Material{}, down, -20.0, down);
  const Points linear = buoyancy_load(make_space(mesh, Element::kP1), Material{}, down, -20.0);
  EXPECT_LT((linear - known).norm(), 1e-12 * known.norm());
  const Points quadratic = buoyancy_load(make_space(mesh, Element::kP2), Material{}, down, -20.0);
  EXPECT_NEAR(sum_along(quadratic, down), sum_along(known, down), 1e-12);
  EXPECT_NEAR(sum_along(known, down), kWeight * 30.0 * 20.0 * 20.0, 1e-12);
}

TEST(Buoyancy, ObliquePlaneThroughTheCentreDrainsHalf) {
  const TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  const Vec3 g = Vec3(-0.5, 0.3, -0.8).normalized();
  const Points load = buoyancy_load(mesh, Material{}, g, g.dot(Vec3(15, 15, 15)), Vec3::UnitX());
  EXPECT_NEAR(sum_along(load, Vec3::UnitX()), kWeight * 13500.0, 1e-12);
}

TEST(Buoyancy, DenserFluidBelowThePlaneLifts) {
  Material material;
  material.fluid_density_saturated_kg_m3 = 1100.0;
  const TetMesh mesh = box_mesh(1, 1, 1, Vec3(10, 10, 10));
  const Points load = buoyancy_load(mesh, material, -Vec3::UnitZ(), -20.0, -Vec3::UnitZ());
  EXPECT_NEAR(load.row(2).sum(), units::weight_density_from_kg_m3(100.0) * 1000.0, 1e-15);
}

TEST(NegativeVolumeFraction, KnowsTheClosedForms) {
  EXPECT_EQ(negative_volume_fraction({1, 2, 3, 4}), 0.0);
  EXPECT_EQ(negative_volume_fraction({-1, -2, -3, -4}), 1.0);
  EXPECT_DOUBLE_EQ(negative_volume_fraction({-1, 1, 1, 1}), 0.125);
  EXPECT_DOUBLE_EQ(negative_volume_fraction({-1, 1, -1, 1}), 0.5);
  EXPECT_DOUBLE_EQ(negative_volume_fraction({0, 0, 0, 0}), 0.0);
  EXPECT_DOUBLE_EQ(negative_volume_fraction({-1, 0, 0, 0}), 1.0);
}

// Independent reference: counting random points. 2e5 points give a standard error below 0.0012.
TEST(NegativeVolumeFraction, AgreesWithCountingPoints) {
  Random random(42);
  for (int trial = 0; trial < 8; ++trial) {
    Eigen::Vector4d values;
    for (int k = 0; k < 4; ++k) values[k] = 2.0 * random.uniform() - 1.0;
    int below = 0;
    constexpr int kPoints = 200000;
    for (int i = 0; i < kPoints; ++i) {
      Eigen::Vector4d weights;  // uniform in the simplex: normalised exponentials
      for (int k = 0; k < 4; ++k) weights[k] = -std::log(1.0 - random.uniform());
      below += values.dot(weights) < 0.0;
    }
    EXPECT_NEAR(negative_volume_fraction(values), below / static_cast<double>(kPoints), 0.006);
    EXPECT_NEAR(negative_volume_fraction(values) + negative_volume_fraction(-values), 1.0, 1e-12);
  }
}

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
