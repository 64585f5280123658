// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/inverter.hpp"
#include "common/operators/encode_columns.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"

namespace brainshift::inversion {
namespace {

TEST(Penetration, CountsSlavesAboveTheToleranceAndKeepsTheDeepest) {
  const PenetrationSummary summary =
      summarise_penetration(VecX{{-2.0, 0.5 * kPenetrationTolerance_mm, 0.3, 0.0, 1.5}});
  EXPECT_EQ(summary.penetrating, 2);
  EXPECT_EQ(summary.max_mm, 1.5);
}

TEST(Penetration, OfOpenSlavesAndOfNoneIsZero) {
  for (const VecX& open : {VecX{{-1.0, -0.1}}, VecX()}) {
    const PenetrationSummary summary = summarise_penetration(open);
    EXPECT_EQ(summary.penetrating, 0);
    EXPECT_EQ(summary.max_mm, 0.0);
  }
}

using EstimateCheck = Condensed;

TEST_F(EstimateCheck, AnOrdinaryEstimateIsUprightAndHasNoWarning) {
  auto inverter = Condensed::inverter(Boundary::kContact);
  const SparseData data = sagging_data(Boundary::kContact, 0.05);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(data, estimate));
  const auto exact = fem::measure_deformation(patient()->mesh, estimate.displacement);
  EXPECT_NEAR(estimate.min_volume_ratio, exact.min_volume_ratio, 1e-4);
  EXPECT_LT(estimate.min_volume_ratio, 1.0);
  EXPECT_GE(estimate.min_nodal_volume_ratio, estimate.min_volume_ratio);
  EXPECT_EQ(estimate.inverted_elements, 0);
  EXPECT_EQ(estimate.reason.find("; "), std::string::npos) << estimate.reason;
}

// Neighbours that are asked to change places, within what check_data lets pass.
TEST_F(EstimateCheck, InvertedElementsAreCountedAndSaid) {
  SparseData data = sagging_data(Boundary::kContact, 0.0);
  for (Eigen::Index i = 0; i < data.positions.cols(); ++i) {
    data.displacements.col(i) = Vec3(i % 2 == 0 ? 9.0 : -9.0, 0.0, 0.0);
  }
  data.sd_mm.setConstant(1e-3);
  auto inverter = Condensed::inverter(Boundary::kContact);
  Estimate estimate;
  const auto status = inverter.update(data, estimate);
  ASSERT_TRUE(status.has_value()) << status.error().message;
  const auto exact = fem::measure_deformation(patient()->mesh, estimate.displacement);
  ASSERT_GT(exact.inverted, 0);
  EXPECT_EQ(estimate.inverted_elements, exact.inverted);
  EXPECT_LT(estimate.min_volume_ratio, 0.0);
  EXPECT_NE(estimate.reason.find(std::to_string(exact.inverted) + " elements inverted"),
            std::string::npos)
      << estimate.reason;
}

// A contact column that is not what contact was solved with.
TEST_F(EstimateCheck, AFieldThatContradictsItsContactForcesIsRefused) {
  const SparseData data = sagging_data(Boundary::kContact, 0.05);
  Estimate estimate;
  auto inverter = Condensed::inverter(Boundary::kContact);
  ASSERT_TRUE(inverter.update(data, estimate));
  ASSERT_FALSE(estimate.active_slaves.empty());
  auto wrong = std::make_shared<CondensedOperators>(*operators(Boundary::kContact));
  const auto slave =
      std::find(wrong->slaves.begin(), wrong->slaves.end(), estimate.active_slaves.front()) -
      wrong->slaves.begin();
  ThreadTeam team(1);
  Eigen::MatrixXf columns = decode_rows(wrong->responses, column_range(0, wrong->num_nodes()),
                                        column_range(0, wrong->responses.num_columns()), team);
  columns.col(wrong->contact_column(static_cast<int>(slave))) *= 1.5F;
  wrong->responses =
      *encode_columns(node_blocks(patient()->mesh.nodes), {group_of(columns, kModeStep)}, team);
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  auto broken = value_or_fail(CondensedInverter::build(wrong, locator, config(), {}));
  const auto status = broken.update(data, estimate);
  EXPECT_THAT(refusal_of(status, ErrorCode::kNotConverged), testing::HasSubstr("equilibrium"));
  EXPECT_EQ(estimate.status, EstimateStatus::kNotRun);
}

TEST_F(EstimateCheck, AFieldThatIsNotFiniteIsRefused) {
  auto wrong = std::make_shared<CondensedOperators>(*operators(Boundary::kContact));
  NodeIndex hidden = 0;  // neither data nor contact look there
  while (std::binary_search(wrong->region.begin(), wrong->region.end(), hidden) ||
         std::count(wrong->slaves.begin(), wrong->slaves.end(), hidden) > 0) {
    ++hidden;
  }
  // Its row of the basis: finite, as a file's must be, but no sum with it is.
  CompactParts parts = wrong->responses.parts();
  const CompactColumns::Place place = wrong->responses.place(hidden);
  const auto sizes = [&](int block) { return Eigen::Vector2i(parts.blocks.col(block).head<2>()); };
  Eigen::Index at = 3 * place.node;
  for (int b = 0; b < place.block; ++b) at += 3 * sizes(b)[0] * sizes(b)[1];
  ASSERT_GT(sizes(place.block)[1], 0);
  for (int j = 0; j < sizes(place.block)[1]; ++j, at += 3 * sizes(place.block)[0]) {
    parts.wide_basis[at] = std::numeric_limits<float>::max();
  }
  wrong->responses = *CompactColumns::from_parts(std::move(parts));
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  auto broken = value_or_fail(CondensedInverter::build(wrong, locator, config(), {}));
  Estimate estimate;
  refusal_of(broken.update(sagging_data(Boundary::kContact, 0.05), estimate),
             ErrorCode::kNotFinite);
}

TEST_F(EstimateCheck, LinearElementsNearIncompressibilityAreSaidToLock) {
  const SparseData data = sagging_data(Boundary::kContact, 0.05);
  CaseConfig nearly = config();
  nearly.material.poisson_ratio = 0.49;
  auto inverter = Condensed::inverter(Boundary::kContact, {}, nearly);
  Estimate estimate;
  ASSERT_TRUE(inverter.update(data, estimate));
  EXPECT_NE(estimate.reason.find("lock"), std::string::npos) << estimate.reason;

  const auto model = value_or_fail(PreparedModel::prepare(patient(), nearly, Boundary::kContact));
  const auto paper = value_or_fail(invert(model, data, Method::kPaper));
  EXPECT_NE(paper.reason.find("lock"), std::string::npos) << paper.reason;
  EXPECT_FALSE(std::isnan(paper.min_volume_ratio));
}

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// An estimate with nothing wrong, each of its figures at or within its bound.
Estimate sound() {
  Estimate estimate;
  estimate.status = EstimateStatus::kConverged;
  estimate.displacement = Points::Zero(3, 4);
  estimate.displacement.col(2) = Vec3(30.0, 0.0, -40.0);  // 50 mm
  estimate.sd_mm = VecX::Constant(4, 0.3);
  estimate.contact_force_n = VecX::Constant(2, 0.01);
  estimate.contact.max_penetration_mm = kDeepestInSkull_mm;
  estimate.contact.decrement = kMaxContactDecrement;
  estimate.contact.max_violation_mm = kMaxContactViolation_mm;
  estimate.misfit_ratio = kUnexplainedMisfit;
  estimate.min_volume_ratio = 0.1;  // of a flat element
  estimate.min_nodal_volume_ratio = kMinVolumeRatio;
  estimate.sources.resize(2);
  estimate.hypotheses.resize(2);
  return estimate;
}

QualityVerdict judged(const Estimate& estimate) {
  QualityVerdict verdict;
  judge(estimate, verdict);
  return verdict;
}

TEST(QualityCheck, AnEstimateWithNothingWrongIsGood) {
  const QualityVerdict verdict = judged(sound());
  EXPECT_EQ(verdict.quality, Quality::kGood);
  EXPECT_TRUE(verdict.flags.empty());
  EXPECT_EQ(verdict.reason, "");
}

// Such as a method of the paper, which has no uncertainty, no scales and no certificate.
TEST(QualityCheck, WhatAMethodDoesNotComputeIsNoFault) {
  Estimate estimate;
  estimate.status = EstimateStatus::kConverged;
  estimate.displacement = Points::Ones(3, 4);
  EXPECT_EQ(judged(estimate).quality, Quality::kGood);
}

struct Fault {
  QualityFlag flag;
  const char* figure;  // in the reason
  std::function<void(Estimate&)> make;
};

std::vector<Fault> faults() {
  const auto above = [](double bound) { return std::nextafter(bound, kInfinity); };
  return {
      {QualityFlag::kMisfitUnexplained, "at most 1.5",
       [=](Estimate& e) { e.misfit_ratio = above(kUnexplainedMisfit); }},
      {QualityFlag::kStrengthAtBound, to_string(static_cast<PriorPart>(kPriorParts - 1)).data(),
       [](Estimate& e) { e.prior_at_bound.back() = true; }},
      {QualityFlag::kSourcesContradict, "\"ius\"",
       [](Estimate& e) {
         e.sources[1].source = "ius";
         e.sources[1].consistent = false;
       }},
      {QualityFlag::kDataOutsideRegion, "(7)", [](Estimate& e) { e.data_outside_region = 7; }},
      {QualityFlag::kDeadline, "time", [](Estimate& e) { e.status = EstimateStatus::kDeadline; }},
      {QualityFlag::kContactNotCertified, "decrement 0.001",
       [=](Estimate& e) { e.contact.decrement = above(kMaxContactDecrement); }},
      {QualityFlag::kContactNotCertified, "violation 0.01 mm",
       [=](Estimate& e) {
         e.contact.decrement = kNan;
         e.contact.max_violation_mm = above(kMaxContactViolation_mm);
       }},
      {QualityFlag::kIterationLimit, "limit",
       [](Estimate& e) { e.status = EstimateStatus::kIterationLimit; }},
      {QualityFlag::kMostlyPrior, "at least 50 %",
       [](Estimate& e) { e.region_known = std::nextafter(kLeastKnown, 0.0); }},
      {QualityFlag::kInvertedElements, "133, smallest volume ratio -0.25",
       [](Estimate& e) {
         e.inverted_elements = 133;
         e.min_volume_ratio = -0.25;
       }},
      {QualityFlag::kVolumeLost, "at least 0.5",
       [](Estimate& e) { e.min_nodal_volume_ratio = std::nextafter(kMinVolumeRatio, 0.0); }},
      {QualityFlag::kBeyondSkull, "motion 50.2 mm, at most 50 mm",
       [](Estimate& e) { e.displacement.col(3) = Vec3(0.0, -50.2, 0.0); }},
      {QualityFlag::kBeyondSkull, "3.5 mm deep in the skull, at most 3 mm",
       [](Estimate& e) { e.contact.max_penetration_mm = 3.5; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.displacement(1, 1) = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.displacement(2, 0) = -kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.sd_mm[3] = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.contact_force_n[0] = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.contact.max_penetration_mm = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.contact.decrement = kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.contact.max_violation_mm = kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.misfit_mm.mean = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.initial_misfit_mm.std = kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.misfit_ratio = kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.min_volume_ratio = -kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.min_nodal_volume_ratio = -kInfinity; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.prior_scales.front() = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.prior_absent.back() = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.hypotheses[1].weight = kNan; }},
      {QualityFlag::kNotFinite, "", [](Estimate& e) { e.hypotheses[0].scales.back() = kInfinity; }},
  };
}

TEST(QualityCheck, EachFaultSetsItsFlagAndNoOther) {
  QualityFlags seen;
  const std::vector<Fault> all = faults();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Fault& fault = all[i];
    SCOPED_TRACE("fault " + std::to_string(i) + ", " + std::string(to_string(fault.flag)));
    Estimate estimate = sound();
    fault.make(estimate);
    const QualityVerdict verdict = judged(estimate);
    QualityFlags expected;
    expected.set(fault.flag);
    EXPECT_EQ(verdict.flags, expected) << verdict.reason;
    EXPECT_EQ(verdict.quality, expected.quality());
    EXPECT_THAT(verdict.reason, testing::StartsWith(std::string(sentence(fault.flag))));
    EXPECT_THAT(verdict.reason, HasSubstr(fault.figure));
    seen.set(fault.flag);
  }
  for (const QualityFlag flag : kAllQualityFlags) {
    EXPECT_TRUE(seen.has(flag)) << "no fault for " << to_string(flag);
  }
}

TEST(QualityCheck, TheReasonNamesEveryFlagTheWorstFirst) {
  Estimate estimate = sound();
  estimate.status = EstimateStatus::kDeadline;
  estimate.inverted_elements = 1;
  estimate.misfit_ratio = 3.0;
  const QualityVerdict verdict = judged(estimate);
  EXPECT_EQ(verdict.quality, Quality::kUnusable);
  EXPECT_THAT(verdict.reason, testing::StartsWith("elements are turned inside out (1,"));
  EXPECT_THAT(verdict.reason, HasSubstr("; the data lie farther off"));
  EXPECT_THAT(verdict.reason, testing::EndsWith("; the time ran out before the inversion settled"));
}

TEST(QualityCheck, NothingOfAnEarlierVerdictStays) {
  Estimate estimate = sound();
  estimate.inverted_elements = 1;
  QualityVerdict verdict;
  judge(estimate, verdict);
  judge(sound(), verdict);
  EXPECT_EQ(verdict.quality, Quality::kGood);
  EXPECT_TRUE(verdict.flags.empty());
  EXPECT_EQ(verdict.reason, "");
}

}  // namespace
}  // namespace brainshift::inversion
