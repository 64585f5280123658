// SPDX-License-Identifier: Apache-2.0
// Verdicts and strengths that a receiver must reject. Round trips: round_trip_test.cpp.
#include <cmath>

#include "brainshift/v1/brainshift.pb.h"
#include "tests/unit/wire/refusals.hpp"
#include "tests/unit/wire/sample_values.hpp"

namespace brainshift::wire {
namespace {

namespace pb = brainshift::v1;

Result<UpdateMessage> decode_changed_verdict(const std::function<void(pb::Update&)>& change) {
  return decode_update(changed<pb::Update>(encode(sample_judged_update()), change));
}

TEST(VerdictRefusal, VerdictsThatAreUnknownOrContradictTheirFlags) {
  const auto expect = [](const char* text, const std::function<void(pb::Update&)>& change) {
    expect_refused(decode_changed_verdict(change), ErrorCode::kProtocol, text);
  };
  expect("update.quality: 4, must be", [](auto& m) { m.set_quality(pb::Quality(4)); });
  expect("update.quality: -1, must be", [](auto& m) { m.set_quality(pb::Quality(-1)); });
  expect("update.quality: 1, must be that of its flags: 3",
         [](auto& m) { m.set_quality(pb::QUALITY_GOOD); });
  expect("update.quality: 2, must be that of its flags: 3",
         [](auto& m) { m.set_quality(pb::QUALITY_CAUTION); });
  expect("update.quality: 0, must be that of its flags: 3", [](auto& m) { m.clear_quality(); });
  expect("update.quality: 3, must be that of its flags: 1",
         [](auto& m) { m.clear_quality_flags(); });
  for (const int unknown : {0, 9, 16, 21, 33, -1}) {
    expect("is unknown", [=](auto& m) { m.set_quality_flags(0, pb::QualityFlag(unknown)); });
    expect("update.quality_flags",
           [=](auto& m) { m.set_quality_flags(0, pb::QualityFlag(unknown)); });
  }
  expect("update.quality_flags: 5 occurs more than once",
         [](auto& m) { m.add_quality_flags(pb::QUALITY_FLAG_DEADLINE); });
  expect("update.quality_flags: 5 occurs more than once", [](auto& m) {
    for (int i = 0; i < 100'000; ++i) m.add_quality_flags(pb::QUALITY_FLAG_DEADLINE);
  });
  expect("update.quality: is present although status is \"failed\"", [](auto& m) {
    m.set_status("failed");
    m.set_error_code("internal");
    m.clear_displacement();
  });
}

TEST(VerdictRefusal, AMarkThatDoesNotFollowFromItsTimes) {
  const auto expect = [](const char* text, const std::function<void(pb::Update&)>& change) {
    expect_refused(decode_changed_verdict(change), ErrorCode::kProtocol, text);
  };
  expect("update.answer_time.late: does not follow",
         [](auto& m) { m.mutable_answer_time()->set_late(false); });
  expect("update.answer_time.late: does not follow",
         [](auto& m) { m.mutable_answer_time()->set_ms(2.0 * 34.25); });
  expect("update.answer_time.ms: -1", [](auto& m) { m.mutable_answer_time()->set_ms(-1.0); });
  expect_refused(
      decode_changed_verdict([](auto& m) { m.mutable_answer_time()->set_usual_ms(std::nan("")); }),
      ErrorCode::kNotFinite, "update.answer_time.usual_ms: is not finite");
}

TEST(VerdictRefusal, StrengthsOfUnknownMissingOrRepeatedParts) {
  const auto expect = [](const char* text, const std::function<void(pb::Update&)>& change) {
    expect_refused(decode_changed_verdict(change), ErrorCode::kProtocol, text);
  };
  expect("update.prior_strengths.part: \"magic\" is unknown",
         [](auto& m) { m.mutable_prior_strengths(0)->set_part("magic"); });
  expect("occurs more than once",
         [](auto& m) { m.mutable_prior_strengths(0)->set_part(m.prior_strengths(1).part()); });
  expect("occurs more than once",
         [](auto& m) { m.add_prior_strengths()->set_part(m.prior_strengths(1).part()); });
  expect("update.hypotheses: are present without", [](auto& m) { m.clear_prior_strengths(); });
  expect("update.prior_strengths.mean: -1, must not be negative",
         [](auto& m) { m.mutable_prior_strengths(0)->set_mean(-1.0); });
  expect("update.prior_strengths.absent: 1.5",
         [](auto& m) { m.mutable_prior_strengths(0)->set_absent(1.5); });
  expect("update.prior_strengths.absent: -0.5",
         [](auto& m) { m.mutable_prior_strengths(0)->set_absent(-0.5); });
  expect("update.hypotheses.scales: ", [](auto& m) { m.mutable_hypotheses(1)->add_scales(1.0); });
  expect("update.hypotheses.scales: ", [](auto& m) { m.mutable_hypotheses(1)->clear_scales(); });
  expect("update.hypotheses.scales: -2",
         [](auto& m) { m.mutable_hypotheses(1)->set_scales(0, -2.0); });
  expect("update.hypotheses.weight: 1.1",
         [](auto& m) { m.mutable_hypotheses(1)->set_weight(1.1); });
  expect("update.hypotheses: 5000 entries, must be at most 4096", [](auto& m) {
    while (m.hypotheses_size() < 5000) *m.add_hypotheses() = m.hypotheses(0);
  });
  expect("update.contact.decrement: -1", [](auto& m) { m.mutable_contact()->set_decrement(-1.0); });
  expect("update.misfit_ratio: -1", [](auto& m) { m.set_misfit_ratio(-1.0); });
  expect("update.region_known: -1", [](auto& m) { m.set_region_known(-1.0); });
  expect("update.region_known: 1.5, must be at most 1", [](auto& m) { m.set_region_known(1.5); });
  expect("update.inverted_elements", [](auto& m) { m.set_inverted_elements(1u << 31); });
  expect("update.data_outside_region", [](auto& m) { m.set_data_outside_region(1u << 31); });
}

TEST(Verdict, PartsMayComeInAnyOrder) {
  const auto decoded = decode_changed_verdict([](auto& m) {
    m.mutable_prior_strengths()->SwapElements(0, kPriorParts - 1);
    for (auto& hypothesis : *m.mutable_hypotheses()) {
      hypothesis.mutable_scales()->SwapElements(0, kPriorParts - 1);
    }
  });
  ASSERT_TRUE(decoded) << decoded.error().message;
  const Estimate& estimate = decoded->update.estimate;
  const Estimate expected = sample_judged_update().update.estimate;
  EXPECT_EQ(estimate.prior_scales, expected.prior_scales);
  EXPECT_EQ(estimate.hypotheses[1].scales, expected.hypotheses[1].scales);
}

// Recordings outlive priors.
TEST(Verdict, APartThatAnOlderPriorDoesNotListIsAbsent) {
  const auto decoded = decode_changed_verdict([](auto& m) {
    m.mutable_prior_strengths()->RemoveLast();
    for (auto& hypothesis : *m.mutable_hypotheses()) hypothesis.mutable_scales()->RemoveLast();
  });
  ASSERT_TRUE(decoded) << decoded.error().message;
  const Estimate& estimate = decoded->update.estimate;
  const Estimate sent = sample_judged_update().update.estimate;
  EXPECT_EQ(estimate.prior_scales.back(), 0.0);
  EXPECT_EQ(estimate.prior_absent.back(), 1.0);
  EXPECT_FALSE(estimate.prior_at_bound.back());
  EXPECT_EQ(estimate.hypotheses[1].scales.back(), 0.0);
  EXPECT_EQ(estimate.prior_scales[1], sent.prior_scales[1]);
  EXPECT_EQ(estimate.hypotheses[1].scales[1], sent.hypotheses[1].scales[1]);
}

class NotFiniteVerdict : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Values, NotFiniteVerdict, ::testing::ValuesIn(kNotFinite), name_of_number);

TEST_P(NotFiniteVerdict, IsRefusedNamingTheField) {
  const double bad = GetParam();
  const auto expect = [](const char* field, const std::function<void(pb::Update&)>& change) {
    expect_refused(decode_changed_verdict(change), ErrorCode::kNotFinite, field);
  };
  expect("update.contact.decrement", [=](auto& m) { m.mutable_contact()->set_decrement(bad); });
  expect("update.contact.max_violation_mm",
         [=](auto& m) { m.mutable_contact()->set_max_violation_mm(bad); });
  expect("update.misfit_ratio", [=](auto& m) { m.set_misfit_ratio(bad); });
  expect("update.region_known", [=](auto& m) { m.set_region_known(bad); });
  expect("update.min_volume_ratio", [=](auto& m) { m.set_min_volume_ratio(bad); });
  expect("update.prior_strengths.mean",
         [=](auto& m) { m.mutable_prior_strengths(0)->set_mean(bad); });
  expect("update.prior_strengths.absent",
         [=](auto& m) { m.mutable_prior_strengths(0)->set_absent(bad); });
  expect("update.hypotheses.scales", [=](auto& m) { m.mutable_hypotheses(0)->set_scales(0, bad); });
  expect("update.hypotheses.weight", [=](auto& m) { m.mutable_hypotheses(0)->set_weight(bad); });
}

}  // namespace
}  // namespace brainshift::wire
