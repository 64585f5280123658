// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/report_json.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/client/tools/monitor/sample_report.hpp"

namespace brainshift::client {
namespace {

using nlohmann::json;

TEST(ReportJson, HoldsWhatTheReportHolds) {
  const json read = json::parse(report_json(sample_report()));
  EXPECT_EQ(read["well"], true);
  EXPECT_EQ(read["complaint"], "");
  EXPECT_EQ(read["session"]["phase"], "tracking");
  EXPECT_EQ(read["session"]["age_ms"], 240.0);
  EXPECT_EQ(read["usable"], 812);
  EXPECT_EQ(read["sources"][0]["source"], "ius");
  EXPECT_EQ(read["sources"][0]["replaced"], 80);
  EXPECT_EQ(read["viewers"][0]["received"], 799);
  EXPECT_EQ(read["stages"][1]["recent"]["p99_ms"], 55.0);
  EXPECT_EQ(read["stages"][1]["bucket_counts"], (json{0, 813}));
  EXPECT_EQ(read["journal"]["file"], "/j/colin27-3.surgery");
  EXPECT_EQ(read["process"]["threads"], 9);
  EXPECT_EQ(read["door"]["closed_for_memory"], 2);
  EXPECT_EQ(read["door"]["refused_starts"], 10);
}

TEST(ReportJson, WhatIsNotThereIsNull) {
  const json read = json::parse(report_json({}));
  EXPECT_EQ(read["well"], false);
  EXPECT_EQ(read["complaint"], "no model is loaded");
  EXPECT_TRUE(read["journal"].is_null());
  EXPECT_TRUE(read["session"]["age_ms"].is_null());
}

TEST(ReportJson, TextThatIsNotUtf8StaysReadable) {
  wire::DaemonReport report;
  report.version = "\xff";
  EXPECT_TRUE(json::accept(report_json(report)));
}

}  // namespace
}  // namespace brainshift::client
