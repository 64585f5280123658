// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/head.hpp"

#include <gtest/gtest.h>

namespace brainshift::client {
namespace {

TEST(Groups, PairBoundariesOfOneKindAndKeepNamesApart) {
  std::vector<ReportedRun> runs(5);
  for (ReportedRun& run : runs) run.report.scenario = "paper";
  runs[0].report.boundary = "contact";
  runs[1].report.boundary = "fixed";
  runs[2].report.boundary = "contact";
  runs[2].report.seed = 2;
  runs[3].report.boundary = "fixed";
  runs[3].report.seed = 2;
  runs[4].report.boundary = "contact";  // a repetition of run 0
  const auto groups = group_runs(runs);
  ASSERT_EQ(groups.size(), 3u);
  EXPECT_EQ(groups[0].contact, 0u);
  EXPECT_EQ(groups[0].fixed, 1u);
  EXPECT_EQ(groups[1].contact, 2u);
  EXPECT_EQ(groups[1].fixed, 3u);
  EXPECT_EQ(groups[1].name, "paper-2");
  EXPECT_EQ(groups[2].contact, 4u);
  EXPECT_FALSE(groups[2].fixed);
  EXPECT_EQ(groups[2].name, "paper-3");
}

TEST(Groups, KeepRunsOfDifferentSeedsApart) {
  std::vector<ReportedRun> runs(2);
  runs[0].report.boundary = "contact";
  runs[1].report.boundary = "fixed";
  EXPECT_EQ(group_runs(runs).size(), 1u);
  runs[1].report.seed = 2;
  EXPECT_EQ(group_runs(runs).size(), 2u);
}

}  // namespace
}  // namespace brainshift::client
