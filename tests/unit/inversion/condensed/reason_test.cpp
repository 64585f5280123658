// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/reason.hpp"

#include <gtest/gtest.h>

#include "common/configuration/case_config.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/values/quality.hpp"

namespace brainshift::inversion {
namespace {

std::string reason(EstimateStatus outcome, Estimate estimate) {
  estimate.contact.iterations = 7;
  estimate.reason = "of the update before";
  set_reason(outcome, 250.0, estimate);
  return estimate.reason;
}
bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Reason, SaysHowTheSearchEnded) {
  Estimate estimate;
  EXPECT_EQ(reason(EstimateStatus::kConverged, estimate), "loads and contact settled in 7 steps");
  estimate.contact.decrement = 0.5;
  EXPECT_TRUE(has(reason(EstimateStatus::kDeadline, estimate), "deadline of 250 ms"));
  EXPECT_TRUE(has(reason(EstimateStatus::kDeadline, estimate), "0.5 standard deviations"));
  EXPECT_TRUE(has(reason(EstimateStatus::kIterationLimit, estimate), "loads did not settle"));
  estimate.contact.decrement = kDecrement;
  EXPECT_TRUE(
      has(reason(EstimateStatus::kIterationLimit, estimate), "places of the data did not settle"));
}

TEST(Reason, NamesWhatThePriorDoesNotExplain) {
  Estimate estimate;
  estimate.misfit_ratio = kUnexplainedMisfit;
  EXPECT_FALSE(has(reason(EstimateStatus::kConverged, estimate), "does not explain"));
  estimate.misfit_ratio = 1.01 * kUnexplainedMisfit;
  EXPECT_TRUE(has(reason(EstimateStatus::kConverged, estimate), "they lie 1.5 standard"));
  EXPECT_FALSE(has(reason(EstimateStatus::kConverged, estimate), "at its bound"));
  estimate.prior_at_bound[static_cast<std::size_t>(PriorPart::kOpening)] = true;
  EXPECT_TRUE(has(reason(EstimateStatus::kConverged, estimate), "strength of opening is at its"));
}

TEST(Reason, NamesSourcesWithOutliersOrContradictions) {
  Estimate estimate;
  estimate.sources.resize(3);
  estimate.sources[0].source = "quiet";
  estimate.sources[1].source = "noisy";
  estimate.sources[1].outliers = 3;
  estimate.sources[1].data = 200;
  estimate.sources[2].source = "contrary";
  estimate.sources[2].consistent = false;
  estimate.sources[2].chi_square = 300.0;
  estimate.sources[2].degrees_of_freedom = 200.0;
  append_sources(estimate);
  EXPECT_FALSE(has(estimate.reason, "quiet"));
  EXPECT_TRUE(has(estimate.reason, "3 of 200 data of \"noisy\" count less as outliers"));
  EXPECT_TRUE(has(estimate.reason,
                  "\"contrary\" contradicts the other sources: chi-square 300 for 200 degrees"));
  std::string text;
  append_outliers(0, 200, text);
  EXPECT_EQ(text, "");
  append_outliers(2, 200, text);
  EXPECT_EQ(text, "; 2 of 200 data count less as outliers");
}

// A source's name comes from a client and may be of any length.
TEST(Reason, CutsLongNames) {
  Estimate estimate;
  estimate.sources.resize(1);
  estimate.sources[0].source = std::string(5000, 'x');
  estimate.sources[0].outliers = 1;
  estimate.sources[0].consistent = false;
  append_sources(estimate);
  EXPECT_LT(estimate.reason.size(), 400U);
  EXPECT_TRUE(has(estimate.reason, "degrees of freedom"));
}

}  // namespace
}  // namespace brainshift::inversion
