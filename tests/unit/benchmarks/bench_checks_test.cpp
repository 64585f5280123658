// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/bench_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::bench {
namespace {

const char* const kRows =
    "mesh,nodes,scenario,method,rank,start,repetition,time_ms,time_over_tsolve,cross_mm,field_mean_"
    "mm,"
    "field_max_mm,recovery_pct,active,iterations,status,coverage_90,t_solve_ms\n"
    "18k,18000,paper,condensed,64,warm,1,4,0.4,0.20,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,condensed,64,warm,2,6,0.6,0.10,0.3,0.9,90,12,2,deadline,0.9,10\n"
    "18k,18000,paper,condensed,128,warm,1,10,1.0,0.20,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,condensed,128,warm,2,20,2.0,0.10,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,condensed,128,warm,3,30,3.0,0.30,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,paper,,cold,1,40000,4000,0.25,0.4,1.0,88,11,19,converged,,10\n"
    "18k,18000,paper,pcg,,cold,1,60000,6000,,,,,,,stopped,,10\n";

Results results_of(const std::string& rows) {
  Results results;
  results.error_time = *CsvTable::parse(rows, "rows");
  results.methods = summarise(results.error_time);
  return results;
}

const Check& named(const std::vector<Check>& checks, const std::string& part) {
  const auto found = std::find_if(checks.begin(), checks.end(), [&](const Check& check) {
    return check.name.find(part) != std::string::npos;
  });
  EXPECT_NE(found, checks.end()) << part;
  return *found;
}

client::RunReport run_with(double p50_ms, double t_solve_ms, int active) {
  client::RunReport run;
  run.latency_ms = client::LatencyPercentiles{p50_ms, p50_ms, p50_ms, p50_ms};
  run.cold_ms = 2.0 * p50_ms;
  run.full_solve_ms = t_solve_ms;
  run.contact = ContactSummary{active, 0, 0.0, 1};
  return run;
}

TEST(BenchSummary, TakesMediansOfTimeAndErrorsOfSharedRepetitions) {
  const Results results = results_of(kRows);
  ASSERT_EQ(results.methods.size(), 4u);
  const MethodSummary* most = results.find("18k", "paper", "condensed", "warm");
  ASSERT_NE(most, nullptr);
  EXPECT_EQ(most->rank, 128) << "the largest unless asked for another";
  EXPECT_DOUBLE_EQ(most->p50_ms, 20.0);
  EXPECT_DOUBLE_EQ(most->max_ms, 30.0);
  EXPECT_EQ(most->compared, 1) << "the paper's method has the first repetition only";
  EXPECT_DOUBLE_EQ(most->cross_mm, 0.20);
  const MethodSummary* fewer = results.find("18k", "paper", "condensed", "warm", 64);
  ASSERT_NE(fewer, nullptr);
  EXPECT_EQ(fewer->status, "1 of 2 converged");
  const MethodSummary* stopped = results.find("18k", "paper", "pcg", "cold");
  ASSERT_NE(stopped, nullptr);
  EXPECT_EQ(stopped->status, "stopped");
  EXPECT_TRUE(std::isnan(stopped->cross_mm));
  EXPECT_TRUE(std::isnan(stopped->p50_ms)) << "a time limit is no run time";
  EXPECT_DOUBLE_EQ(stopped->max_ms, 60000.0);
  EXPECT_EQ(results.find("40k", "paper", "condensed", "warm"), nullptr);
}

TEST(BenchChecks, WhatWasNotMeasuredDoesNotPass) {
  const auto all = checks(Results{}, "out", true);
  for (const Check& check : all) {
    EXPECT_FALSE(check.pass) << check.name;
    EXPECT_TRUE(std::isnan(check.value)) << check.name;
  }
  const auto json = nlohmann::json::parse(to_json(all, {"a part"}));
  ASSERT_EQ(json["checks"].size(), all.size());
  EXPECT_TRUE(json["checks"][0]["value"].is_null());
  EXPECT_FALSE(json["checks"][0]["pass"].get<bool>());
  EXPECT_EQ(json["left_out"][0], "a part");
}

// The paper's method on five measurements, one more than the condensed method has.
std::string five_by_the_paper(double paper_ms, double paper_mm, double condensed_mm) {
  const std::string all = kRows;
  std::string rows = all.substr(0, all.find('\n') + 1);
  for (int i = 1; i <= 5; ++i) {
    std::ostringstream text;
    text << "18k,18000,paper,paper,,cold," << i << ',' << paper_ms << ",4000," << paper_mm + 0.1 * i
         << ",0.4,1.0,88,11,19,converged,,10\n";
    if (i < 5) {
      text << "18k,18000,paper,condensed,128,warm," << i << ",20,2," << condensed_mm + 0.1 * i
           << ",0.3,0.9,90,10,2,converged,0.9,10\n";
    }
    rows += text.str();
  }
  return rows;
}

TEST(BenchChecks, RatioToThePaperNeedsTheSameErrorOrBetterOverSeveralMeasurements) {
  const auto check = [](const std::string& rows) {
    return named(checks(results_of(rows), "out", false), "paper's method");
  };
  const Check good = check(five_by_the_paper(40000, 0.25, 0.25));
  EXPECT_TRUE(good.pass);
  EXPECT_DOUBLE_EQ(good.value, 2000.0);
  EXPECT_NE(good.name.find("0.5 and 0.5 mm over 4 measurements"), std::string::npos) << good.name;
  EXPECT_FALSE(check(five_by_the_paper(40000, 0.25, 0.26)).pass) << "a greater error";
  EXPECT_FALSE(check(five_by_the_paper(19000, 0.25, 0.25)).pass) << "950 times";
  EXPECT_FALSE(check(kRows).pass) << "one measurement";
}

TEST(BenchChecks, TimesAreInUnitsOfTheSolveOfTheSameReport) {
  Results results;
  results.runs["sag-progress"] = run_with(5.0, 10.0, 400);
  results.runs["distension"] = run_with(20.0, 10.0, 501);
  results.runs["no-contact"] = run_with(4.0, 10.0, 0);
  const auto all = checks(results, "out", false);
  EXPECT_DOUBLE_EQ(named(all, "warm update with contact").value, 0.5);
  EXPECT_TRUE(named(all, "warm update with contact").pass);
  EXPECT_DOUBLE_EQ(named(all, "cold update").value, 4.0);
  EXPECT_FALSE(named(all, "cold update").pass);
  EXPECT_FALSE(named(all, "update without contact").pass) << "0.4 is above 0.3";
  results.runs["distension"] = run_with(10.0, 10.0, 500);
  EXPECT_FALSE(named(checks(results, "out", false), "cold update").pass) << "too few active";
}

TEST(BenchChecks, TailAndMemoryNeedTheirNumberOfUpdates) {
  Results results;
  results.latency_ms["sag-progress"].assign(1999, 5.0);
  results.facts = {{"rss_before_bytes", 1e9}, {"rss_after_bytes", 1e9}, {"growth_updates", 10000}};
  auto all = checks(results, "out", false);
  EXPECT_TRUE(named(all, "p99").pass);
  EXPECT_TRUE(named(all, "growth").pass);
  results.latency_ms["sag-progress"].pop_back();
  results.facts["growth_updates"] = 9999;
  all = checks(results, "out", false);
  EXPECT_FALSE(named(all, "p99").pass);
  EXPECT_FALSE(named(all, "growth").pass);
}

TEST(BenchResults, ReadsTheLargestRankOfTheComparisonWithTheDirectPosterior) {
  const test_support::TemporaryFolder folder;
  std::ofstream(folder.path() / "direct-distension.json") << R"({"exact_max_mm": 1e-9,
             "reduced": [{"rank": 32, "max_mm": 0.5}, {"rank": 128, "max_mm": 0.002}]})";
  std::ofstream(folder.path() / "prepare.json")
      << R"({"total_s": 12.5, "mesh": {"nodes": 7}, "peak_memory_bytes": 100})";
  const auto results = read_results(folder.path());
  ASSERT_TRUE(results) << results.error().message;
  EXPECT_DOUBLE_EQ(results->fact("direct_max_mm distension"), 0.002);
  EXPECT_DOUBLE_EQ(results->fact("exact_max_mm distension"), 1e-9);
  EXPECT_TRUE(std::isnan(results->fact("direct_max_mm paper")));
  EXPECT_DOUBLE_EQ(results->fact("prepare_s"), 12.5);
  EXPECT_TRUE(std::isnan(results->fact("model_file_bytes")));
  std::ofstream(folder.path() / "direct-paper.json") << "[";
  EXPECT_EQ(read_results(folder.path()).error().code, ErrorCode::kUnreadable);
  EXPECT_EQ(read_results(folder.path() / "none").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::bench
