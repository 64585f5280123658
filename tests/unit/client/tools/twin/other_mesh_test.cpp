// SPDX-License-Identifier: GPL-3.0-or-later
// Truths from another mesh with quadratic elements, on the toy patient.
#include "client/tools/twin/other_mesh.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "client/tools/twin/adverse.hpp"
#include "client/tools/twin/surgery.hpp"
#include "client/tools/twin/truth_load.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

// Gravity alone, as on a case with a mesh of 6 cells.
Scenario sag() {
  Scenario scenario = *find_scenario("paper");
  scenario.fluid_levels_mm = {30.0};
  return scenario;
}

Scenario elsewhere(Scenario scenario) {
  scenario.adverse.other_mesh = true;
  return scenario;
}

struct Played {
  TruthBrain brain;
  Truth truth;
  Points displacement;  // at the case's nodes
};

Played solve(const BrainModel& model, const Scenario& scenario, const BrainModel* other) {
  const CaseConfig config = test_support::toy_config();
  auto brain = truth_brain(model, config, scenario, 1, other);
  EXPECT_TRUE(brain) << brain.error().message;
  const auto forward = truth_forward(*brain);
  EXPECT_TRUE(forward) << forward.error().message;
  TruthSolver solver(*forward);
  const Points load =
      gravity_load(*brain, gravity_of(brain->model, scenario), scenario.fluid_levels_mm[0]) +
      constant_load(*brain, scenario);
  auto truth = solver.solve(load);
  EXPECT_TRUE(truth) << truth.error().message;
  Points u = displacement_at_nodes(*brain, truth->displacement);
  return {std::move(*brain), std::move(*truth), std::move(u)};
}

double difference(const Points& a, const Points& b) {
  return (a - b).colwise().norm().mean() / b.colwise().norm().mean();
}

// Quadratic elements on 5 cells come nearer to quadratic elements on 10 cells than linear ones on 6
// do, at the nodes of the case.
TEST(OtherMesh, QuadraticElementsAreNearerToTheLimitThanTheCasesOwn) {
  const BrainModel model = test_support::toy_patient(6);
  const BrainModel coarse = test_support::toy_patient(5), fine = test_support::toy_patient(9);
  const Points own = solve(model, sag(), nullptr).displacement;
  const Points quadratic = solve(model, elsewhere(sag()), &coarse).displacement;
  const Points limit = solve(model, elsewhere(sag()), &fine).displacement;
  ASSERT_EQ(own.cols(), quadratic.cols());
  EXPECT_LT(difference(quadratic, limit), difference(own, limit));
  EXPECT_LT(difference(quadratic, limit), 0.10);
  EXPECT_GT(difference(own, limit), 0.02);  // what an inverse crime hides
}

TEST(OtherMesh, TheSkullHoldsItsMiddlesOfEdges) {
  Scenario scenario = elsewhere(sag());
  scenario.fluid_levels_mm = {0.0};
  scenario.swelling = {0.5, 42.0, 9.0};
  const BrainModel model = test_support::toy_patient(6), other = test_support::toy_patient(5);
  const Played played = solve(model, scenario, &other);
  const auto forward = truth_forward(played.brain);
  ASSERT_TRUE(forward);
  double widest = 0.0;
  for (const contact::ContactPair& pair : forward->contact().pairs()) {
    EXPECT_GE(pair.slave, played.brain.elsewhere->space.num_vertices());
    EXPECT_LT(pair.initial_penetration_mm, -0.5);  // the box's edges are rounded off
    widest = std::max(widest, -pair.initial_penetration_mm);
  }
  EXPECT_NEAR(widest, 1.0, 0.03);  // the toy's gap
  EXPECT_GT(played.truth.active, 10);
  EXPECT_LT(played.truth.max_penetration_mm, 0.1);
  // Nearer to a mesh with six times as many elements than the case's own mesh is.
  const BrainModel fine = test_support::toy_patient(9);
  const Points limit = solve(model, scenario, &fine).displacement;
  scenario.adverse.other_mesh = false;
  const Points own = solve(model, scenario, nullptr).displacement;
  EXPECT_LT(difference(played.displacement, limit), difference(own, limit));
  EXPECT_LT(difference(played.displacement, limit), 0.3);
}

// A surgery from another mesh is scored on the case's mesh and measured where the truth is.
TEST(OtherMesh, ASurgeryKeepsToTheCasesNodes) {
  const BrainModel model = test_support::toy_patient(6), other = test_support::toy_patient(5);
  const Scenario scenario = elsewhere(sag());
  auto brain = truth_brain(model, test_support::toy_config(), scenario, 1, &other);
  ASSERT_TRUE(brain) << brain.error().message;
  const auto forward = truth_forward(*brain);
  ASSERT_TRUE(forward);
  TruthSolver solver(*forward);
  const auto surgery = play_scenario(*brain, solver, scenario, 1);
  ASSERT_TRUE(surgery) << surgery.error().message;
  const io::SurgeryTruth& truth = surgery->truths[0];
  EXPECT_EQ(truth.displacement.cols(), model.mesh.num_nodes());
  EXPECT_EQ(truth.scalars.at("truth_nodes"), brain->elsewhere->space.num_nodes());
  for (const auto& [kind, points] : truth.points) {
    for (const io::ScorePoint& point : points) {
      EXPECT_LT(point.nodes.maxCoeff(), model.mesh.num_nodes()) << kind;
    }
  }
  EXPECT_EQ(surgery->observations[0].case_id, model.case_id);
}

TEST(OtherMesh, AnotherHeadIsRefused) {
  const BrainModel model = test_support::toy_patient(6);
  BrainModel elsewhere = test_support::toy_patient(5);
  elsewhere.mesh.nodes.row(0).array() += 12.0;
  const auto other = make_other_mesh(model, elsewhere);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(other.error().message, testing::HasSubstr("12.0 mm"));
}

TEST(OtherMesh, ACaseWithAReadyMeshIsRefused) {
  CaseConfig config = test_support::toy_config();
  config.mesh = MeshFile{"head.msh"};
  const auto anew = mesh_anew(config);
  ASSERT_FALSE(anew);
  EXPECT_EQ(anew.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(anew.error().message, testing::HasSubstr("mesh.file"));
}

// A quadratic displacement is met exactly at any place.
TEST(SpacePoints, MeetQuadraticDisplacementsExactly) {
  const BrainModel model = test_support::toy_patient(5);
  const fem::DisplacementSpace space = fem::make_space(model.mesh, fem::Element::kP2);
  const auto field = [](const Vec3& x) {
    return Vec3(1e-3 * x[0] * x[1], 2e-3 * x[2] * x[2], 0.1 * x[0] - 1e-3 * x[1] * x[2]);
  };
  Points u(3, space.num_nodes());
  for (int i = 0; i < space.num_nodes(); ++i) u.col(i) = field(space.nodes.col(i));
  const SpacePoints places(geometry::TetLocator(model.mesh), model.tumour.vertices);
  EXPECT_EQ(places.farthest_outside_mm(), 0.0);
  const Points values = places.displacement(space, u);
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    EXPECT_LT((values.col(i) - field(model.tumour.vertices.col(i))).norm(), 1e-10);
  }
}

}  // namespace
}  // namespace brainshift::client
