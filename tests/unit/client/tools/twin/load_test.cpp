// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/load.hpp"

#include <gtest/gtest.h>

#include "common/fem/elasticity.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

constexpr double kEverywhere_mm = 1e9;  // so wide that the strain is uniform over the mesh

class SwellingLoad : public testing::Test {
 protected:
  SwellingLoad() { test_support::perturb_interior(mesh, 2.0, 3); }
  TetMesh mesh = test_support::box_mesh(4, 3, 5, Vec3(40, 30, 50));
  Material material;
};

// Uniform swelling of a free body is u = theta / 3 x without stress, so K u must be the load. K
// comes from the element stiffness, the load from the gradients alone.
TEST_F(SwellingLoad, IsWhatStretchesAFreeBodyByAThirdOfItsStrain) {
  const double theta = 0.06;
  fem::DofMap dofs(mesh.num_nodes());
  dofs.finalise();
  const auto K = fem::assemble_stiffness(mesh, fem::elasticity_from(material), dofs);
  const VecX expected = linalg::multiply(K, dofs.restrict_to(theta / 3.0 * mesh.nodes));
  const VecX load =
      dofs.restrict_to(swelling_load(mesh, material, Vec3::Zero(), {theta, kEverywhere_mm}));
  ASSERT_GT(expected.norm(), 1e-3);
  EXPECT_LT((load - expected).norm(), 1e-10 * expected.norm());
}

TEST_F(SwellingLoad, BalancesItself) {
  const Points f = swelling_load(mesh, material, Vec3(20, 15, 25), {0.2, 18.0});
  ASSERT_GT(f.norm(), 1e-3);
  EXPECT_LT(f.rowwise().sum().norm(), 1e-12 * f.norm());
  Vec3 moment = Vec3::Zero();
  for (int i = 0; i < mesh.num_nodes(); ++i)
    moment += Vec3(mesh.nodes.col(i)).cross(Vec3(f.col(i)));
  EXPECT_LT(moment.norm(), 1e-10 * f.norm());
}

TEST_F(SwellingLoad, PushesAwayFromItsCentreAndShrinkagePulls) {
  const Vec3 centre(20, 15, 25);
  const auto outward = [&](double strain) {
    const Points f = swelling_load(mesh, material, centre, {strain, 18.0});
    double sum = 0.0;
    for (int i = 0; i < mesh.num_nodes(); ++i) sum += f.col(i).dot(mesh.nodes.col(i) - centre);
    return sum;
  };
  EXPECT_GT(outward(0.1), 0.0);
  EXPECT_NEAR(outward(-0.1), -outward(0.1), 1e-12 * outward(0.1));
}

// Its work along u = x is int kappa theta div x dV = 3 kappa int theta dV: of all the volume, or of
// the half in which the tumour lies. The box is symmetric about x = 20; the rest of 1 % is left to
// the middle, where the strain changes within an element.
TEST(VolumeChangeLoad, ActsOnTheWholeBrainOrOnTheTumoursHalf) {
  const TetMesh mesh = test_support::box_mesh(16, 6, 8, Vec3(40, 30, 50));
  const Material material;
  const fem::Elasticity elasticity = fem::elasticity_from(material);
  const double kappa = elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
  const double whole = 3.0 * kappa * -0.015 * 40.0 * 30.0 * 50.0;
  const auto work = [&](const Points& f) { return (f.array() * mesh.nodes.array()).sum(); };
  const Vec3 left(8, 15, 25), right(32, 15, 25);
  EXPECT_NEAR(work(volume_change_load(mesh, material, left, {-0.015, false})), whole,
              1e-9 * std::abs(whole));
  const Points f_left = volume_change_load(mesh, material, left, {-0.015, true});
  const Points f_right = volume_change_load(mesh, material, right, {-0.015, true});
  EXPECT_NEAR(work(f_left), 0.5 * whole, 0.01 * std::abs(whole));
  EXPECT_NEAR(work(f_right), 0.5 * whole, 0.01 * std::abs(whole));
  // At the outer faces only the half that changes pulls.
  double at_left = 0.0, at_right = 0.0;
  for (int i = 0; i < mesh.num_nodes(); ++i) {
    if (mesh.nodes(0, i) == 0.0) at_left += f_left(0, i);
    if (mesh.nodes(0, i) == 40.0) at_right += f_left(0, i);
  }
  EXPECT_GT(at_left, 0.0);  // inwards: it shrinks
  EXPECT_LT(std::abs(at_right), 0.01 * at_left);
}

TEST(VolumeStrain, FadesFromTheCentreToNothingAtTheRadius) {
  const Swelling swelling{0.4, 20.0};
  EXPECT_DOUBLE_EQ(volume_strain_at(swelling, 0.0), 0.4);
  EXPECT_DOUBLE_EQ(volume_strain_at(swelling, 10.0), 0.4 * 0.75 * 0.75);
  EXPECT_DOUBLE_EQ(volume_strain_at(swelling, 20.0), 0.0);
  EXPECT_DOUBLE_EQ(volume_strain_at(swelling, 25.0), 0.0);
  EXPECT_DOUBLE_EQ(volume_strain_at(Swelling{}, 0.0), 0.0);
}

TEST(SwellingCentre, LiesDeepToTheTumourAsSeenFromTheCraniotomy) {
  const BrainModel model =
      test_support::toy_patient();  // craniotomy above the tumour at (30, 30, 40)
  const Vec3 tumour = model.tumour.vertices.rowwise().mean();
  EXPECT_EQ(swelling_centre(model, {0.1, 20.0}), tumour);
  const Vec3 centre = swelling_centre(model, {0.1, 20.0, 15.0});
  EXPECT_NEAR((centre - tumour).norm(), 15.0, 1e-12);
  EXPECT_LT(centre.z(), tumour.z() - 14.0);
}

}  // namespace
}  // namespace brainshift::client
