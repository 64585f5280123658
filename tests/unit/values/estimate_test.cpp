// SPDX-License-Identifier: Apache-2.0
#include "common/values/estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace brainshift {
namespace {

// The names are keys of case files, reports and the command line: they must not change.
TEST(Estimate, NamesOfMethodsAndStatesAreStable) {
  EXPECT_EQ(to_string(Boundary::kContact), "contact");
  EXPECT_EQ(to_string(Boundary::kFixed), "fixed");
  EXPECT_EQ(to_string(Method::kCondensed), "condensed");
  EXPECT_EQ(to_string(Method::kPaper), "paper");
  EXPECT_EQ(to_string(Method::kPaperWoodbury), "paper-woodbury");
  EXPECT_EQ(to_string(Method::kIterativeSolver), "pcg");
  EXPECT_EQ(to_string(EstimateStatus::kNotRun), "not_run");
  EXPECT_EQ(to_string(EstimateStatus::kIterating), "iterating");
  EXPECT_EQ(to_string(EstimateStatus::kConverged), "converged");
  EXPECT_EQ(to_string(EstimateStatus::kIterationLimit), "iteration_limit");
  EXPECT_EQ(to_string(EstimateStatus::kDeadline), "deadline");
}

TEST(Estimate, AllMethodsAreListedOnce) {
  std::set<std::string_view> names;
  for (const Method method : kAllMethods) names.insert(to_string(method));
  EXPECT_EQ(names.size(), 4u);
}

TEST(Estimate, HasNotRunByDefault) {
  EXPECT_EQ(Estimate{}.status, EstimateStatus::kNotRun);
  EXPECT_EQ(Estimate{}.displacement.cols(), 0);
  EXPECT_TRUE(std::isnan(Estimate{}.min_volume_ratio));
  EXPECT_TRUE(std::isnan(Estimate{}.min_nodal_volume_ratio));
}

TEST(Estimate, EveryPartOfThePriorBeginsAsInTheCase) {
  for (const double scale : kAsInTheCase) EXPECT_EQ(scale, 1.0);
  for (int part = 0; part < kPriorParts; ++part) {
    EXPECT_NE(to_string(static_cast<PriorPart>(part)), "unknown") << part;
  }
}

TEST(AnswerTime, IsLateBeyondTwiceTheUsual) {
  EXPECT_FALSE((AnswerTime{200.0, 100.0}.late()));
  EXPECT_TRUE((AnswerTime{200.5, 100.0}.late()));
  EXPECT_FALSE((AnswerTime{1e6, 0.0}.late())) << "nothing is usual yet";
  EXPECT_FALSE(AnswerTime{}.late());
  EXPECT_EQ(sentence({812.4, 34.25}),
            "answered 812.4 ms after its observation came, usually 34.2 ms");
}

}  // namespace
}  // namespace brainshift
