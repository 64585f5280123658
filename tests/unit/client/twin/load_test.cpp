// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/load.hpp"

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
