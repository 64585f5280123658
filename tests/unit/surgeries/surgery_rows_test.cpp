// SPDX-License-Identifier: GPL-3.0-or-later
// Scores of estimates that are made from the truth, so that every figure is known.

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/surgeries/surgery_rows.hpp"

namespace brainshift::surgeries {
namespace {

class Score : public testing::Test {
 protected:
  Score() {
    const int n = model.mesh.num_nodes();
    // A rotation about the brain's middle, a shift, and a dent that no rigid motion has.
    const Mat3 turn = Eigen::AngleAxisd(0.03, Vec3::UnitX()).toRotationMatrix();
    truth.displacement =
        (turn - Mat3::Identity()) * (model.mesh.nodes.colwise() - Vec3(30, 30, 30));
    truth.displacement.colwise() += Vec3(0, 0, -2);
    for (const NodeIndex node : model.craniotomy) {
      truth.points["craniotomy"].push_back({Eigen::Vector4i::Constant(node)});
    }
    for (int i = 0; i < n; ++i) {
      if ((model.mesh.nodes.col(i) - Vec3(30, 30, 40)).norm() > 15.0) continue;
      truth.points[i % 2 == 0 ? "sparse" : "cross"].push_back({Eigen::Vector4i::Constant(i)});
    }
    estimate.displacement = truth.displacement;
    estimate.sd_mm = VecX::Constant(n, 0.1);
  }
  UpdateScore score() const { return value_or_fail(score_update(model, truth, estimate)); }

  BrainModel model = test_support::toy_patient(6);
  io::SurgeryTruth truth;
  Estimate estimate;
};

TEST_F(Score, OfTheTruthIsPerfect) {
  const UpdateScore of = score();
  EXPECT_DOUBLE_EQ(of.recovered_pct, 100.0);
  EXPECT_DOUBLE_EQ(of.estimate.max_mm, 0.0);
  EXPECT_DOUBLE_EQ(of.coverage_90, 1.0);
  EXPECT_NEAR(of.mean_sd_mm, 0.1, 1e-12);
  EXPECT_EQ(of.worse_nodes, 0);
  EXPECT_LT(of.worst_excess_mm, -kRadius90 * 0.1);
}

// Errors of one standard deviation along x and of two along y: inside some of the intervals.
TEST_F(Score, CountsTheComponentsInsideEveryInterval) {
  estimate.displacement.row(0).array() += 0.1;
  estimate.displacement.row(1).array() -= 0.2;
  const UpdateScore of = score();
  const std::array<double, 6> inside = {1, 1, 2, 2, 2, 3};  // of three
  for (std::size_t i = 0; i < inside.size(); ++i) {
    EXPECT_DOUBLE_EQ(of.coverage[i], inside[i] / 3.0) << kIntervals[i].percent;
  }
  EXPECT_DOUBLE_EQ(of.coverage_90, of.coverage[3]);
  estimate.sd_mm.resize(0);
  EXPECT_TRUE(std::isnan(score().coverage[0]));
}

// The share of a Gaussian within r standard deviations is erf(r / sqrt 2); within the ball of that
// radius in three dimensions erf(r / sqrt 2) - sqrt(2 / pi) r exp(-r^2 / 2).
TEST_F(Score, IntervalsHoldTheShareOfAGaussianThatTheySay) {
  const auto within = [](double r) { return std::erf(r / std::sqrt(2.0)); };
  for (const Interval& each : kIntervals) {
    EXPECT_NEAR(100.0 * within(each.radius), each.percent, 3e-3) << each.percent;
  }
  const double in_ball = within(kRadius90) - std::sqrt(2.0 / std::numbers::pi) * kRadius90 *
                                                 std::exp(-0.5 * kRadius90 * kRadius90);
  EXPECT_NEAR(100.0 * in_ball, 90.0, 1e-3);
}

// The 0.95 quantile of the standard normal is 1.64485: just within it along x, beyond it along y.
TEST_F(Score, CoverageOfNinetyPercentEndsAtTheQuantile) {
  estimate.displacement.row(0).array() += 0.1 * 1.6447;
  estimate.displacement.row(1).array() -= 0.1 * 1.6451;
  const UpdateScore of = score();
  EXPECT_DOUBLE_EQ(of.coverage_90, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(of.coverage[3], 2.0 / 3.0);
}

TEST_F(Score, TheRigidMotionOfATruthThatIsRigidLeavesNothing) {
  const UpdateScore of = score();
  EXPECT_GT(of.none.mean_mm, 1.5);
  EXPECT_LT(of.rigid.max_mm, 0.05);  // a rotation's displacement is not quite linear: 0.03^2 r / 2
  truth.displacement(2, model.craniotomy.front()) -= 3.0;
  estimate.displacement = truth.displacement;
  EXPECT_NEAR(score().rigid.max_mm, 3.0, 0.05);
}

TEST_F(Score, AConstantErrorIsWhatItIsEverywhere) {
  estimate.displacement.colwise() += Vec3(0.12, 0, 0);
  const UpdateScore of = score();
  for (const double error : {of.estimate.tumour_mm, of.estimate.craniotomy_mm, of.estimate.mean_mm,
                             of.estimate.p50_mm, of.estimate.max_mm}) {
    EXPECT_NEAR(error, 0.12, 1e-12);
  }
  EXPECT_LT(of.estimate.craniotomy_closest_mm, 0.02);  // along the surface
  EXPECT_DOUBLE_EQ(of.coverage_90, 1.0);               // 0.12 < 1.64 * 0.1
  estimate.displacement.colwise() += Vec3(0.12, 0, 0);
  EXPECT_DOUBLE_EQ(score().coverage_90, 2.0 / 3.0);  // two of three components are right
}

// Worse than no correction by more than its interval: the error beyond |t| by 2.5 sd.
TEST_F(Score, ANodeIsWorseWhenItsIntervalDoesNotExplainIt) {
  const double motion = truth.displacement.col(3).norm();
  estimate.displacement.col(3) += Vec3(0, motion + 0.24, 0);
  EXPECT_EQ(score().worse_nodes, 0);
  EXPECT_NEAR(score().worst_excess_mm, 0.24 - 0.25003, 1e-9);
  estimate.displacement.col(3) += Vec3(0, 0.02, 0);
  EXPECT_EQ(score().worse_nodes, 1);
  EXPECT_NEAR(score().worst_excess_mm, 0.26 - 0.25003, 1e-9);
  estimate.sd_mm.resize(0);
  EXPECT_NEAR(score().worst_excess_mm, 0.26, 1e-9);
  EXPECT_TRUE(std::isnan(score().coverage_90));
}

TEST_F(Score, NodesInACavityDoNotCount) {
  estimate.displacement.col(3) += Vec3(0, 50, 0);
  EXPECT_NEAR(score().estimate.max_mm, 50.0, 1e-9);
  truth.points["removed"] = {{Eigen::Vector4i::Constant(3)}};
  const UpdateScore of = score();
  EXPECT_DOUBLE_EQ(of.estimate.max_mm, 0.0);
  EXPECT_DOUBLE_EQ(of.coverage_90, 1.0);
  EXPECT_EQ(of.worse_nodes, 0);
}

// Of a region: within 0.68 but beyond 0.50.
TEST_F(Score, RegionsHaveTheSharesOfTheirOwnNodesInEveryInterval) {
  estimate.displacement.array() += 0.1 * 0.8;
  const UpdateScore of = score();
  const std::array<double, 6> inside = {0, 1, 1, 1, 1, 1};
  for (std::size_t i = 0; i < inside.size(); ++i) {
    EXPECT_DOUBLE_EQ(of.near.coverage[i], inside[i]) << kIntervals[i].percent;
  }
  EXPECT_DOUBLE_EQ(of.near.coverage_90, 1.0);
}

// What an update marks as unseen may be wrong; what it does not mark is its word.
TEST_F(Score, AFarErrorIsUnmarkedWhereTheUpdateSaysThatItKnows) {
  EXPECT_TRUE(std::isnan(score().far_known));  // the method does not say
  truth.points["sparse"] = {{Eigen::Vector4i::Constant(0)}};
  truth.points["cross"] = {{Eigen::Vector4i::Constant(1)}, {Eigen::Vector4i::Constant(7)}};
  const int n = model.mesh.num_nodes();
  estimate.displacement.row(1).array() += 4.0;
  estimate.known = VecX::Constant(n, 0.49);
  EXPECT_NEAR(score().far_known, 0.49, 1e-12);
  EXPECT_GT(score().far.nodes, 0);
  EXPECT_DOUBLE_EQ(score().far_unmarked_mm, 0.0);
  estimate.known.setConstant(0.5);
  EXPECT_NEAR(score().far_unmarked_mm, 4.0, 1e-12);
  EXPECT_NEAR(score().near_known, 0.5, 1e-12);
}

TEST_F(Score, AnEstimateOfAnotherMeshIsRefused) {
  estimate.displacement = Points::Zero(3, 5);
  EXPECT_FALSE(score_update(model, truth, estimate));
}

using testing::HasSubstr;

SurgeryFacts facts(std::uint64_t seed, const std::string& scenario) {
  SurgeryFacts facts;
  facts.key = {"head", 2, seed, scenario};
  return facts;
}

Row row(const SurgeryFacts& of) {
  Update update;
  update.estimate.reason = "settled, at last";
  update.estimate.quality.flags.set(QualityFlag::kStrengthAtBound);
  update.estimate.quality.flags.set(QualityFlag::kVolumeLost);
  update.estimate.quality.quality = update.estimate.quality.flags.quality();
  update.timings.register_ms = 1.0;
  update.timings.invert_ms = 2.0;
  update.timings.rebuild_ms = 4.0;
  UpdateScore score;
  score.recovered_pct = 97.5;
  return row_of(of, {}, {}, 0, update, score, std::numeric_limits<double>::quiet_NaN());
}

class RowTable : public testing::Test {
 protected:
  RowFile open(bool resume) { return value_or_fail(open_surgeries(path, resume)); }
  test_support::TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "rows.csv";
};

TEST_F(RowTable, ReadsBackWhatAnUpdateWas) {
  RowFile file = open(false);
  const SurgeryFacts one = facts(7, "paper");
  ASSERT_TRUE(file.append({row(one), refused_row(one, 1, "no data, no estimate")}));
  const auto table = value_or_fail(bench::CsvTable::read(path));
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.text(0, "scenario"), "paper");
  EXPECT_EQ(table.text(0, "stage"), "tumour");
  EXPECT_EQ(table.number(0, "place"), 2.0);
  EXPECT_EQ(table.number(0, "seed"), 7.0);
  EXPECT_EQ(table.text(0, "reason"), "settled; at last");
  EXPECT_EQ(table.text(0, "quality"), "unusable");
  EXPECT_EQ(table.text(0, "flags"), "strength_at_bound;volume_lost");
  EXPECT_EQ(table.number(0, "recovered_pct"), 97.5);
  EXPECT_EQ(table.number(0, "update_ms"), 7.0);
  EXPECT_EQ(table.text(0, "warm_cold_mm"), "");
  EXPECT_EQ(table.text(1, "status"), "refused");
  EXPECT_EQ(table.text(1, "reason"), "no data; no estimate");
  EXPECT_EQ(table.text(1, "quality"), "");
  EXPECT_EQ(table.text(1, "recovered_pct"), "");
  EXPECT_EQ(table.text(1, "stage"), "tumour+cortex");
}

TEST_F(RowTable, ARunThatGoesOnKnowsWhatIsThere) {
  const SurgeryFacts one = facts(7, "paper"), other = facts(8, "paper");
  {
    RowFile file = open(true);
    EXPECT_FALSE(file.has(one.key.texts()));
    ASSERT_TRUE(file.append({row(one)}));
    EXPECT_TRUE(file.has(one.key.texts()));
  }
  RowFile again = open(true);
  EXPECT_TRUE(again.has(one.key.texts()));
  EXPECT_FALSE(again.has(other.key.texts()));
  EXPECT_FALSE(again.has(facts(7, "joint-sag").key.texts()));
  ASSERT_TRUE(again.append({row(other)}));
  EXPECT_EQ(bench::CsvTable::read(path)->rows(), 2u);
  EXPECT_FALSE(open(false).has(one.key.texts()));
  EXPECT_EQ(bench::CsvTable::read(path)->rows(), 0u);
}

TEST_F(RowTable, TwoRunsDoNotWriteToOneTable) {
  RowFile first = open(true);
  ASSERT_TRUE(first.append({row(facts(7, "paper"))}));
  RowFile second = open(true);
  ASSERT_TRUE(second.append({row(facts(8, "paper"))}));
  EXPECT_THAT(refusal_of(first.append({row(facts(8, "paper"))}), ErrorCode::kWriteFailed),
              HasSubstr("another run writes to it"));
  ASSERT_TRUE(second.append({row(facts(9, "paper"))}));
  std::filesystem::remove(path);
  EXPECT_FALSE(second.append({row(facts(9, "paper"))}));
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(RowTable, ATableOfOtherColumnsIsNotContinued) {
  std::ofstream(path) << "head,place\nx,1\n";
  EXPECT_THAT(refusal_of(open_surgeries(path, true), ErrorCode::kUnreadable),
              HasSubstr("rows.csv"));
}

TEST_F(RowTable, ARowThatWasCutOffIsReported) {
  {
    RowFile file = open(false);
    const SurgeryFacts one = facts(7, "paper");
    ASSERT_TRUE(file.append({row(one)}));
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 60);
  EXPECT_THAT(sentence_of(open_surgeries(path, true)), HasSubstr("line 2"));
}

TEST_F(RowTable, AFolderThatIsNotThereIsReported) {
  refusal_of(open_surgeries(folder.path() / "none" / "rows.csv", false), ErrorCode::kWriteFailed);
}

}  // namespace

}  // namespace brainshift::surgeries
