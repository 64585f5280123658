// SPDX-License-Identifier: GPL-3.0-or-later
// More of it in condensed_inverter_test.cpp.
#include "common/inversion/condensed/mode_posterior.hpp"

#include "common/inversion/condensed/source_check.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

using ModePosteriorTest = Condensed;

// p of the rows first ... first + count - 1 under given strengths, by the check itself.
double p_value(const Eigen::MatrixXd& j, int first, int count, const PriorStrengths& strengths,
               const PriorScaleValues& scales) {
  const Eigen::Index size = j.cols() - 1;
  const Eigen::MatrixXd own = j.middleRows(first, count);
  VecX prior(size);
  for (int i = 0; i < size; ++i) {
    prior[i] = std::pow(std::max(1e-4, strengths.scale_of(i, scales)), -2);
  }
  const Eigen::MatrixXd all_gram = j.leftCols(size).transpose() * j.leftCols(size);
  const Eigen::MatrixXd own_gram = own.leftCols(size).transpose() * own.leftCols(size);
  const VecX all_right = j.leftCols(size).transpose() * j.col(size);
  const VecX own_right = own.leftCols(size).transpose() * own.col(size);
  SourceCheck check;
  Consistency result;
  EXPECT_TRUE(check.run(all_gram, all_right, own_gram, own_right, prior, result));
  return result.p_value;
}

TEST_F(ModePosteriorTest, ASourceContradictsOnlyWhereTheMeanOverTheHypothesesSaysSo) {
  const auto brain = operators(Boundary::kFixed);
  const ModeWindow window{0, brain->num_modes()};
  ThreadTeam team(1);
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  ContactSystem system(*brain, window, 1.0, team);
  ContactReduction no_contact(*brain, window, system);
  int agreed = 0, contradicted = 0, under_the_first = 0;
  for (int trial = 0; trial < 80; ++trial) {
    SparseData data = sagging_data(Boundary::kFixed, 0.3, 4);
    const int half = data.size() / 2, rest = data.size() - half;
    data.displacements *= 0.025;
    data.displacements.rightCols(rest).colwise() += Vec3(0.0, 0.01 * trial, 0.0);
    SampledOperators sampled(brain, locator, window, OutsideRegion::kExtend, team);
    sampled.reserve(data.size());
    ASSERT_TRUE(sampled.locate(data));
    sampled.sample(data, RemainderVariances::Ones(), VecX::Ones(data.size()));
    ModePosterior posterior(window);
    posterior.reserve(data.size());
    posterior.linearise(sampled, no_contact, team);
    PriorStrengths strengths(brain->part_columns, window, SparseData::kMaxCommonErrors, true, team);
    ASSERT_TRUE(strengths.fit(posterior.gram(), posterior.right_hand_side()));
    Consistency found;
    ASSERT_TRUE(posterior.check_source(sampled, strengths, {"pointer", half, rest}, found));
    double mean = 0.0;
    for (const Hypothesis& each : strengths.hypotheses()) {
      mean +=
          each.weight * p_value(sampled.free_body(), 3 * half, 3 * rest, strengths, each.scales);
    }
    const double held =
        p_value(sampled.free_body(), 3 * half, 3 * rest, strengths, strengths.held());
    if (held >= kInconsistent) {
      EXPECT_NEAR(found.p_value, held, 1e-6);
      ++under_the_first;
    } else if (mean >= kInconsistent) {
      EXPECT_GE(found.p_value, kInconsistent);
      EXPECT_LE(found.p_value, mean * (1.0 + 1e-6));
      ++agreed;
    } else {
      EXPECT_LT(found.p_value, kInconsistent);
      EXPECT_LE(found.p_value, mean * (1.0 + 1e-6));
      ++contradicted;
    }
  }
  EXPECT_GT(agreed, 0) << under_the_first << " " << contradicted;
  EXPECT_GT(contradicted, 0);
  EXPECT_GT(under_the_first, 0);
}

}  // namespace
}  // namespace brainshift::inversion
