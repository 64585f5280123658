// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/score.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/tools/replay/box.hpp"

namespace brainshift::client {
namespace {

io::ScorePoint at_node(NodeIndex node) {
  io::ScorePoint point;
  point.nodes = Eigen::Vector4i::Constant(node);
  return point;
}

Points uniform(int nodes, const Vec3& u) { return u.replicate(1, nodes); }

// The box sinks by 1 mm as a whole; cross-validation at two nodes, craniotomy on the top face.
class SinkingBox : public testing::Test {
 protected:
  SinkingBox() : model(box_model()), nodes(model.mesh.num_nodes()) {
    truth.displacement = uniform(nodes, Vec3(0, 0, -1));
    truth.points["cross"] = {at_node(0), at_node(7)};
    for (const NodeIndex node : model.craniotomy)
      truth.points["craniotomy"].push_back(at_node(node));
    truth.scalars["fluid_level_mm"] = 40.0;
  }
  RunReport scored(const Points& displacement, const VecX& sd = {}) const {
    Estimate estimate;
    estimate.displacement = displacement;
    estimate.sd_mm = sd;
    estimate.misfit_mm = {0.4, 0.2};
    estimate.initial_misfit_mm = {1.1, 0.3};
    RunReport run;
    describe(model, estimate, run);
    const Status status = score(model, truth, estimate, run);
    EXPECT_TRUE(status) << (status ? "" : status.error().message);
    return run;
  }

  BrainModel model;
  int nodes;
  io::SurgeryTruth truth;
};

TEST_F(SinkingBox, TenthOfTheMotionMissingIsNinetyPercentRecovery) {
  const RunReport run = scored(0.9 * truth.displacement);
  EXPECT_NEAR(run.error_mm.initial->mean, 1.0, 1e-12);
  EXPECT_NEAR(run.error_mm.cross->mean, 0.1, 1e-12);
  EXPECT_NEAR(*run.recovery_pct, 90.0, 1e-9);
  EXPECT_NEAR(run.error_mm.craniotomy_initial->mean, 1.0, 1e-12);
  EXPECT_NEAR(run.error_mm.craniotomy->mean, 0.1, 1e-12);
  EXPECT_NEAR(run.error_mm.craniotomy->std, 0.0, 1e-12);
  EXPECT_NEAR(*run.craniotomy_recovery_pct, 90.0, 1e-9);
  EXPECT_NEAR(run.field_error_pct->p50, 10.0, 1e-9);
  EXPECT_NEAR(run.field_error_pct->max, 10.0, 1e-9);
  EXPECT_NEAR(*run.share_below_5_pct, 0.0, 1e-12);
  EXPECT_NEAR(*run.largest_true_displacement_mm, 1.0, 1e-12);
  EXPECT_EQ(run.truth_scalars.at("fluid_level_mm"), 40.0);
  EXPECT_EQ(run.error_mm.sparse->mean, 0.4);
  EXPECT_EQ(run.error_mm.sparse_initial->mean, 1.1);
}

TEST_F(SinkingBox, SlidingAlongTheSurfaceIsSeenByDisplacementButNotByClosestPoint) {
  const RunReport run = scored(uniform(nodes, Vec3(0.3, 0.4, -1)));
  EXPECT_NEAR(run.error_mm.craniotomy->mean, 0.0, 1e-12);
  EXPECT_NEAR(run.error_mm.craniotomy_displacement->mean, 0.5, 1e-12);
  EXPECT_NEAR(run.error_mm.craniotomy_displacement_initial->mean, 1.0, 1e-12);
  EXPECT_NEAR(*run.craniotomy_displacement_recovery_pct, 50.0, 1e-9);
  EXPECT_NEAR(*run.craniotomy_recovery_pct, 100.0, 1e-9);
}

TEST_F(SinkingBox, SurfaceAboveAndBelowTruthCountAlike) {
  EXPECT_NEAR(scored(uniform(nodes, Vec3(0, 0, -0.8))).error_mm.craniotomy->mean, 0.2, 1e-12);
  EXPECT_NEAR(scored(uniform(nodes, Vec3(0, 0, -1.2))).error_mm.craniotomy->mean, 0.2, 1e-12);
}

TEST_F(SinkingBox, WorseThanNothingIsNegativeRecovery) {
  EXPECT_NEAR(*scored(uniform(nodes, Vec3(0, 0, 1))).recovery_pct, -100.0, 1e-9);
}

TEST_F(SinkingBox, FieldErrorPercentilesFollowTheOneWrongNode) {
  Points displacement = truth.displacement;
  displacement.col(5) += Vec3(0, 0, 0.5);
  const RunReport run = scored(displacement);
  EXPECT_NEAR(run.field_error_pct->p50, 0.0, 1e-12);
  EXPECT_NEAR(run.field_error_pct->max, 50.0, 1e-9);
  EXPECT_NEAR(*run.share_below_5_pct, 100.0 * (nodes - 1) / nodes, 1e-9);
}

TEST_F(SinkingBox, CoverageCountsComponentsWithinTheNinetyPercentInterval) {
  Points displacement = truth.displacement;
  displacement.row(0).array() += 1.6;  // inside 1.6449 sd
  displacement.row(1).array() -= 1.7;  // outside
  EXPECT_NEAR(*scored(displacement, VecX::Ones(nodes)).coverage_90, 2.0 / 3.0, 1e-12);
  EXPECT_FALSE(scored(displacement).coverage_90);
}

TEST_F(SinkingBox, WhatIsKnownOfTheRegionIsToldAndOtherwiseAbsent) {
  Estimate estimate;
  RunReport run;
  describe(model, estimate, run);
  EXPECT_FALSE(run.region_known);
  estimate.region_known = 0.25;
  describe(model, estimate, run);
  EXPECT_EQ(run.region_known, 0.25);
}

TEST_F(SinkingBox, WithoutScorePointsOnlyTheFieldIsScored) {
  truth.points.clear();
  const RunReport run = scored(0.9 * truth.displacement);
  EXPECT_FALSE(run.error_mm.initial);
  EXPECT_FALSE(run.error_mm.cross);
  EXPECT_FALSE(run.recovery_pct);
  EXPECT_FALSE(run.error_mm.craniotomy);
  EXPECT_TRUE(run.field_error_pct);
}

TEST_F(SinkingBox, NoTrueMotionLeavesShareNumbersEmpty) {
  truth.displacement.setZero();
  const RunReport run = scored(uniform(nodes, Vec3(0, 0, 0.1)));
  EXPECT_FALSE(run.recovery_pct);
  EXPECT_FALSE(run.field_error_pct);
  EXPECT_FALSE(run.principal_direction_true_deg);
}

TEST_F(SinkingBox, EstimateOfAnotherMeshIsRefused) {
  Estimate estimate;
  estimate.displacement = uniform(nodes - 1, Vec3(0, 0, -1));
  RunReport run;
  refusal_of(score(model, truth, estimate, run), ErrorCode::kProtocol);
}

TEST(ScorePoints, ValueIsTheBarycentricSum) {
  Points nodal(3, 4);
  nodal << 0, 1, 2, 3, 10, 20, 30, 40, -1, 0, 1, 0;
  io::ScorePoint point;
  point.nodes = {3, 2, 1, 0};
  point.weights = {0.1, 0.2, 0.3, 0.4};
  const Points value = at_points(nodal, {point});
  EXPECT_TRUE(value.col(0).isApprox(Vec3(0.3 + 0.4 + 0.3, 4 + 6 + 6 + 4, 0.2 - 0.4), 1e-12));
}

TEST(PrincipalDirection, IsTheLineAlongWhichDisplacementsVary) {
  const Vec3 along = Vec3(3, 4, 12) / 13.0;
  Points displacements(3, 50);
  for (int i = 0; i < 50; ++i) displacements.col(i) = 0.1 * i * along + Vec3(0.2, -0.1, 0.05);
  EXPECT_NEAR((principal_direction(displacements) - along).norm(), 0.0, 1e-9);
  // follows the mean
  EXPECT_NEAR((principal_direction(-displacements) + along).norm(), 0.0, 1e-9);
}

TEST(PrincipalDirection, SpreadDecidesNotTheMean) {
  // All move by about 5 mm in x, but they differ in y: the variance about the mean lies along y.
  Points displacements(3, 2);
  displacements << 5, 5, -1, 2, 0, 0;
  EXPECT_NEAR(std::abs(principal_direction(displacements).y()), 1.0, 1e-12);
}

TEST(PrincipalDirection, EqualDisplacementsHaveNone) {
  EXPECT_TRUE(principal_direction(uniform(9, Vec3(1, 2, 3))).isZero());
  EXPECT_TRUE(principal_direction(Points(3, 0)).isZero());
}

TEST(Angle, MatchesKnownAnglesAlsoNearZero) {
  EXPECT_NEAR(angle_deg(Vec3(1, 0, 0), Vec3(0, 3, 0)), 90.0, 1e-12);
  EXPECT_NEAR(angle_deg(Vec3(1, 0, 0), Vec3(-2, 0, 0)), 180.0, 1e-12);
  EXPECT_NEAR(angle_deg(Vec3(1, 0, 0), Vec3(std::sqrt(3.0), 1, 0)), 30.0, 1e-12);
  EXPECT_NEAR(angle_deg(Vec3(1, 0, 0), Vec3(1, 1e-10, 0)), 1e-10 * 180.0 / std::numbers::pi, 1e-16);
}

class TruthInFile : public SinkingBox {
 protected:
  Result<std::optional<io::SurgeryTruth>> stored_and_read() {
    auto file = value_or_fail(io::SurgeryFile::create(path, io::SurgeryMeta{"box"}));
    EXPECT_TRUE(file.write_truth(1, truth));
    return read_truth(file, 1, model);
  }
  const test_support::TemporaryFolder folder;
  const std::filesystem::path path = folder / "truth.surgery";
};

TEST_F(TruthInFile, ComesBackAsWritten) {
  const auto read = value_or_fail(stored_and_read());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->displacement, truth.displacement);
  EXPECT_EQ(read->points.at("cross").size(), 2u);
}

TEST_F(TruthInFile, IsAbsentForARealRecording) {
  auto file = value_or_fail(io::SurgeryFile::create(path, io::SurgeryMeta{"box"}));
  const auto read = value_or_fail(read_truth(file, 1, model));
  EXPECT_FALSE(read);
}

TEST_F(TruthInFile, OfAnotherMeshNamesBothCounts) {
  truth.displacement = uniform(nodes + 2, Vec3::Zero());
  EXPECT_THAT(refusal_of(stored_and_read(), ErrorCode::kUnreadable),
              testing::HasSubstr(std::to_string(nodes + 2)));
}

TEST_F(SinkingBox, TruthWithAPointOutsideTheMeshNamesKindAndNode) {
  truth.points["cross"][1] = at_node(nodes);
  EXPECT_THAT(
      refusal_of(check_truth(truth, nodes), ErrorCode::kUnreadable),
      testing::AllOf(testing::HasSubstr("cross 1"), testing::HasSubstr(std::to_string(nodes))));
}

TEST_F(SinkingBox, TruthWithWeightsThatDoNotSumToOneIsRefused) {
  truth.points["craniotomy"][0].weights = {0.5, 0.4, 0, 0};
  EXPECT_FALSE(check_truth(truth, nodes));
  truth.points["craniotomy"][0].weights = {0.5, 0.5, std::nan(""), 0};
  EXPECT_FALSE(check_truth(truth, nodes));
  truth.points["craniotomy"][0].weights = {0.5, 0.5, 0, 0};
  EXPECT_TRUE(check_truth(truth, nodes));
}

TEST_F(SinkingBox, TruthThatIsNotFiniteIsRefused) {
  truth.displacement(1, 3) = std::nan("");
  EXPECT_FALSE(check_truth(truth, nodes));
}

}  // namespace
}  // namespace brainshift::client
