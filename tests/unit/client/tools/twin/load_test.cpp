// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <set>

#include "client/tools/twin/load.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/fem/elasticity.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"
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

// The toy patient's opening is a disc of radius 16 mm in the plane z = 60, its normal +z.
class RetractionLoad : public testing::Test {
 protected:
  BrainModel model = test_support::toy_patient(24);
  Retraction straight{3000.0, 10.0, 0.0};
};

// int p (1 - (r/R)^2)^2 dA = p pi R^2 / 3. The nodes sample it 2.5 mm apart.
TEST_F(RetractionLoad, IsThePressureOverTheSpatula) {
  const Points load = retraction_load(model, straight);
  const double force_N = 3000e-6 * std::numbers::pi * 10.0 * 10.0 / 3.0;
  EXPECT_NEAR(load.row(2).sum(), -force_N, 0.03 * force_N);
  EXPECT_EQ(load.topRows<2>().cwiseAbs().maxCoeff(), 0.0);
  Retraction twice = straight;
  twice.pressure_pa *= 2.0;
  EXPECT_LT((retraction_load(model, twice) - 2.0 * load).norm(), 1e-12 * load.norm());
}

TEST_F(RetractionLoad, ActsWithinItsRadiusOnExposedNodesOnly) {
  Retraction moved = straight;
  moved.offset_mm = Vec3(5, 0, 77);  // the part along the normal does not count
  const Points load = retraction_load(model, moved);
  const Vec3 middle = craniotomy_centre(model) + Vec3(5, 0, 0);
  const std::set<NodeIndex> exposed(model.craniotomy.begin(), model.craniotomy.end());
  int loaded = 0;
  for (NodeIndex node = 0; node < model.mesh.num_nodes(); ++node) {
    if (load.col(node).isZero(0.0)) continue;
    ++loaded;
    EXPECT_TRUE(exposed.count(node)) << node;
    EXPECT_LT((model.mesh.nodes.col(node) - middle).norm(), 10.0);
  }
  EXPECT_GT(loaded, 10);
}

TEST_F(RetractionLoad, TurnsTowardsTheSideByItsAngle) {
  const Points pressed = retraction_load(model, straight);
  Retraction aside = straight;
  aside.angle_deg = 30.0;
  aside.aside = Vec3(0, 8, -5);
  const Points load = retraction_load(model, aside);
  EXPECT_LT((load.row(1) + 0.5 * pressed.row(2)).norm(), 1e-12 * load.norm());
  EXPECT_LT((load.row(2) - std::sqrt(0.75) * pressed.row(2)).norm(), 1e-12 * load.norm());
  EXPECT_EQ(load.row(0).norm(), 0.0);
}

TEST(Retraction, ThatTouchesNoExposedNodeIsAnError) {
  Scenario scenario = *find_scenario("retraction");
  scenario.fluid_levels_mm = {-20.0};
  scenario.retraction->offset_mm = Vec3(200, 0, 0);
  EXPECT_THAT(refusal_of(play_scenario(test_support::toy_patient(6), test_support::toy_config(),
                                       scenario, 1),
                         ErrorCode::kInvalidArgument),
              testing::HasSubstr("presses on no node of the opening"));
}

TEST(Retraction, PushesTheCortexIntoTheBrain) {
  const BrainModel model = test_support::toy_patient(8);
  Scenario scenario = *find_scenario("retraction");
  scenario.fluid_levels_mm = {-20.0};
  scenario.retraction->angle_deg = 0.0;
  const auto play = [&] {
    return value_or_fail(play_scenario(model, test_support::toy_config(), scenario, 1));
  };
  const SimulatedSurgery pressed = play();
  scenario.retraction.reset();
  const Points change = pressed.truths[0].displacement - play().truths[0].displacement;
  EXPECT_EQ(pressed.truths[0].scalars.at("retraction_pa"), 4000.0);
  EXPECT_LT(change(Eigen::all, model.craniotomy).row(2).mean(), -0.5);
}

}  // namespace
}  // namespace brainshift::client
