// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/advice/advice.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/registration/alignment_data.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::advice {
namespace {

class AdviceTest : public inversion::Condensed {
 protected:
  // Without contact, fitted strengths and robust weights an estimate is linear in its data, and its
  // covariance does not depend on them: what is predicted must come true.
  static CaseConfig linear() {
    CaseConfig made = config();
    made.sensing.robust_weights = false;
    return made;
  }
  static const geometry::TetLocator& locator() {
    static const geometry::TetLocator made(patient()->mesh);
    return made;
  }
  static SparseData few(int first, int count, double sd_mm) {
    const SparseData all = sagging_data(Boundary::kFixed, 0.0);
    SparseData data;
    data.positions = all.positions.middleCols(first, count);
    data.displacements = all.displacements.middleCols(first, count);
    data.sd_mm = VecX::Constant(count, sd_mm);
    data.sources = {{std::to_string(first), 0, count}};
    return data;
  }
  // Some along a direction, with a common error.
  static SparseData more() {
    SparseData data = few(20, 12, 0.4);
    data.directions = Points::Zero(3, 12);
    for (int i = 0; i < 6; ++i) {
      const Vec3 n = Vec3(1, i, -2).normalized();
      data.directions.col(i) = n;
      data.displacements.col(i) = n * n.dot(data.displacements.col(i));
    }
    data.common_error = registration::pose_errors(data.positions, 0.3, 1.0);
    return data;
  }
  struct Updated {
    inversion::PosteriorModes modes;
    Estimate estimate;
  };
  static Updated updated(const SparseData& data, Boundary boundary = Boundary::kFixed) {
    auto made = inverter(boundary, {}, linear());
    Updated result;
    EXPECT_TRUE(made.update(data, result.estimate).has_value());
    result.modes = made.posterior();
    result.estimate.sd_mm /= std::max(1.0, result.estimate.misfit_ratio);
    return result;
  }
  static Points node(NodeIndex index) { return patient()->mesh.nodes.col(index); }
};

TEST_F(AdviceTest, TheSdAtANodeIsThatOfTheEstimateWithContactToo) {
  for (const Boundary boundary : {Boundary::kFixed, Boundary::kContact}) {
    const auto now = updated(sagging_data(boundary, 0.0), boundary);
    EXPECT_EQ(now.modes.active.empty(), boundary == Boundary::kFixed);
    const Posterior spread(now.modes, locator());
    for (const NodeIndex at : {3, 60, 111, 180}) {
      EXPECT_NEAR(spread.sd_mm(value_or_fail(spread.at(node(at)))), now.estimate.sd_mm[at],
                  1e-3 * now.estimate.sd_mm[at]);
    }
  }
}

TEST_F(AdviceTest, WhatIsPredictedIsWhatTheInversionGivesOnceTheDataAreThere) {
  const SparseData before = few(0, 8, 0.5), data = more();
  const auto now = updated(before), then = updated(combine({before, data}));
  const Posterior spread(now.modes, locator());
  const auto at_data = value_or_fail(spread.at(data.positions));
  double most = 0.0;
  for (const NodeIndex at : {3, 60, 111, 180}) {
    const auto target = value_or_fail(spread.at(node(at)));
    const double predicted = value_or_fail(spread.sd_after_mm(target, data, at_data));
    EXPECT_NEAR(predicted, then.estimate.sd_mm[at], 2e-3 * then.estimate.sd_mm[at]);
    most = std::max(most, 1.0 - predicted / spread.sd_mm(target));
  }
  EXPECT_GT(most, 0.1);  // it is worth something
}

TEST_F(AdviceTest, ItIsGaussianConditioningInTheSpaceOfTheData) {
  const SparseData data = more();
  const auto modes = updated(few(0, 8, 0.5)).modes;
  const Posterior spread(modes, locator());
  const auto target = value_or_fail(spread.at(patient()->mesh.nodes.middleCols(50, 7)));
  const auto at_data = value_or_fail(spread.at(data.positions));
  Eigen::MatrixXd select = Eigen::MatrixXd::Zero(data.rows(), 3 * data.size());
  for (int i = 0, row = 0; i < data.size(); ++i) {
    if (data.along_direction(i)) {
      select.block<1, 3>(row++, 3 * i) = data.directions.col(i).transpose();
    } else {
      select.block<3, 3>(row, 3 * i).setIdentity();
      row += 3;
    }
  }
  Eigen::MatrixXd noise = data.common_error * data.common_error.transpose();
  for (int i = 0; i < data.size(); ++i) {
    const double left_out =
        at_data.region[static_cast<std::size_t>(i)] ? 0 : at_data.left_out_mm2[i];
    noise.diagonal().segment<3>(3 * i).array() += data.sd_mm[i] * data.sd_mm[i] + left_out;
  }
  const Eigen::MatrixXd m = select * at_data.modes * modes.factor;
  const Eigen::MatrixXd s = m * m.transpose() + select * noise * select.transpose();
  const Eigen::MatrixXd at_target = target.modes * modes.factor;
  const Eigen::MatrixXd cross = at_target * m.transpose();
  const Eigen::MatrixXd after =
      at_target * at_target.transpose() - cross * test_support::solve(s, cross.transpose());
  const double expected = std::sqrt((after.trace() / 3.0 + target.left_out_mm2.sum()) / 7.0);
  EXPECT_NEAR(value_or_fail(spread.sd_after_mm(target, data, at_data)), expected, 1e-9);
}

TEST_F(AdviceTest, APointOutsideTheBrainIsNamed) {
  const Posterior spread(updated(few(0, 8, 0.5)).modes, locator());
  EXPECT_THAT(refusal_of(spread.at(Vec3(30, 30, 99)), ErrorCode::kInvalidArgument),
              testing::HasSubstr("point (30.0, 30.0, 99.0) mm lies"));
}

class RankTest : public AdviceTest {
 protected:
  RankTest()
      : pipeline_(value_or_fail(pipeline::Pipeline::build(
            *patient(), linear(), Method::kCondensed, Boundary::kFixed,
            value_or_fail(inversion::condensed_inverter(
                operators(Boundary::kFixed),
                std::make_shared<const geometry::TetLocator>(patient()->mesh), linear()))))) {}
  std::vector<Advice> ranked(const std::vector<Candidate>& candidates, const Target& target) {
    Observation observation;
    observation.source = "pointer";
    observation.sequence = 1;
    const SparseData data = few(0, 8, 0.5);
    observation.body = LandmarkPairs{data.positions, data.positions + data.displacements, 0.5};
    const auto update = value_or_fail(pipeline_.run(observation));
    return value_or_fail(rank(pipeline_, linear(), locator(), update.estimate, candidates, target));
  }
  pipeline::Pipeline pipeline_;
};

TEST_F(RankTest, TheBestComesFirstAndWhatCannotBeMeasuredLastWithItsReason) {
  const auto advice = ranked({{"one point", Kind::kPoint, Vec3(20, 30, 30).replicate(1, 2)},
                              {"far", Kind::kPoint, Vec3(5, 5, 5).replicate(1, kTouches)},
                              {"at it", Kind::kPoint, Vec3(30, 30, 40).replicate(1, kTouches)}},
                             {"here", Vec3(30, 30, 40)});
  ASSERT_EQ(advice.size(), 3u);
  EXPECT_EQ(advice[0].candidate.name, "at it");
  EXPECT_GT(advice[0].reduction_mm(), 5.0 * advice[1].reduction_mm());
  EXPECT_GT(advice[1].reduction_mm(), 0.0);
  EXPECT_EQ(advice[0].before_mm, advice[1].before_mm);
  EXPECT_EQ(advice[2].candidate.name, "one point");
  EXPECT_THAT(advice[2].reason, testing::HasSubstr("at least 3 are needed"));
  EXPECT_EQ(advice[2].reduction_mm(), 0.0);
}

TEST_F(RankTest, EverySectorOfTheTumourSaysSomethingOfIt) {
  const auto advice = ranked(default_candidates(*patient()), tumour_target(*patient()));
  EXPECT_GE(advice.size(), 8u);
  for (const Advice& one : advice) {
    EXPECT_EQ(one.reason, "") << one.candidate.name;
    EXPECT_GT(one.reduction_mm(), 0.0) << one.candidate.name;
    EXPECT_LT(one.after_mm, one.before_mm);
    EXPECT_GT(one.data, 2);
  }
}

TEST_F(RankTest, BeforeAnUpdateThereIsNoAdvice) {
  EXPECT_THAT(refusal_of(rank(pipeline_, linear(), locator(), {}, {}, {"here", Vec3(30, 30, 40)}),
                         ErrorCode::kNotConverged),
              testing::HasSubstr("left unknown"));
}

}  // namespace
}  // namespace brainshift::advice
