// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/scenario.hpp"

#include <gtest/gtest.h>

#include <set>

#include "client/tools/twin/simulate.hpp"

namespace brainshift::client {
namespace {

TEST(Scenarios, AreNamedOnceAndDescribedInOneLine) {
  std::set<std::string> names;
  for (const ScenarioInfo& info : scenarios()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.description.empty());
    EXPECT_EQ(info.description.find('\n'), std::string::npos);
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"paper", "paper-icp", "distension", "sag-progress", "no-contact",
                                   "joint-sag", "joint-distension", "joint-tangential",
                                   "joint-mixed", "resection", "retraction", "patient-1",
                                   "patient-2", "patient-3", "patient-4", "patient-5"}));
}

TEST(SagProgress, TheFluidFallsSteadilyFrom15To55InTwentyObservations) {
  const Scenario* scenario = find_scenario("sag-progress");
  ASSERT_NE(scenario, nullptr);
  const auto& levels = scenario->fluid_levels_mm;
  ASSERT_EQ(levels.size(), 20u);
  EXPECT_DOUBLE_EQ(levels.front(), 15.0);
  EXPECT_DOUBLE_EQ(levels.back(), 55.0);
  for (std::size_t i = 1; i < levels.size(); ++i) {
    EXPECT_NEAR(levels[i] - levels[i - 1], 40.0 / 19.0, 1e-12);
  }
}

}  // namespace
}  // namespace brainshift::client
