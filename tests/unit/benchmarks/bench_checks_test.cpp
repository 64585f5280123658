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

const char* const kHeading =
    "mesh,nodes,scenario,method,prior,rank,start,repetition,time_ms,time_over_tsolve,cross_mm,"
    "field_mean_mm,field_max_mm,recovery_pct,active,iterations,status,coverage_90,t_solve_ms\n";
const std::string kRows =
    std::string(kHeading) +
    "18k,18000,paper,condensed,case,64,warm,1,4,0.4,0.20,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,condensed,case,64,warm,2,6,0.6,0.10,0.3,0.9,90,12,2,deadline,0.9,10\n"
    "18k,18000,paper,condensed,case,128,warm,1,10,1.0,0.20,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,condensed,case,128,warm,2,20,2.0,0.10,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,condensed,case,128,warm,3,30,3.0,0.30,0.3,0.9,90,10,2,converged,0.9,10\n"
    "18k,18000,paper,paper,case,,cold,1,40000,4000,0.25,0.4,1.0,88,11,19,converged,,10\n"
    "18k,18000,paper,paper,paper,,cold,1,50000,5000,0.45,0.4,1.0,88,11,19,converged,,10\n"
    "18k,18000,paper,pcg,case,,cold,1,60000,6000,,,,,,,stopped,,10\n";

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
  ASSERT_EQ(results.methods.size(), 5u);
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
  const MethodSummary* own =
      results.find("18k", "paper", "paper", "cold", Results::kLargestRank, "paper");
  ASSERT_NE(own, nullptr) << "the paper's prior is a row of its own";
  EXPECT_DOUBLE_EQ(own->p50_ms, 50000.0);
}

TEST(BenchChecks, WhatWasNotMeasuredDoesNotPass) {
  const auto all = checks(Results{}, "out");
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

// Surgeries by the condensed method and by Woodbury's form; two of them by the paper's method too.
std::string surgeries(int count, double paper_ms, double paper_mm, double condensed_mm) {
  std::ostringstream rows;
  rows << kHeading;
  const auto row = [&](const char* method, const char* rank, int i, double ms, double mm) {
    for (const char* mesh : {"5k,5000", "18k,18000"}) {
      rows << mesh << ",paper," << method << ",case," << rank << ",cold," << i << ',' << ms
           << ",4000," << mm + 0.01 * i << ',' << mm + 0.02 * i
           << ",1.0,88,11,19,converged,0.9,10\n";
    }
  };
  for (int i = 1; i <= count; ++i) {
    row("condensed", "116", i, 20, condensed_mm);
    row("paper-woodbury", "", i, 0.4 * paper_ms, paper_mm);
    if (i <= 2) row("paper", "", i, paper_ms, paper_mm);
  }
  return rows.str();
}

TEST(BenchChecks, RatioToThePaperNeedsErrorsThatAreNotLargerOverTwentySurgeries) {
  const auto check = [](const std::string& rows, const std::string& method = "paper, the case") {
    return named(checks(results_of(rows), "out"), method);
  };
  const Check good = check(surgeries(20, 15000, 0.25, 0.25));
  EXPECT_TRUE(good.pass);
  EXPECT_DOUBLE_EQ(good.value, 750.0);
  EXPECT_NE(good.name.find("over 20 surgeries"), std::string::npos) << good.name;
  EXPECT_TRUE(check(surgeries(20, 15000, 0.25, 0.25), "paper-woodbury, the case").pass);
  EXPECT_FALSE(check(surgeries(20, 15000, 0.25, 0.26)).pass) << "a greater error";
  EXPECT_FALSE(check(surgeries(20, 13000, 0.25, 0.25)).pass) << "650 times";
  EXPECT_FALSE(check(surgeries(19, 15000, 0.25, 0.25)).pass) << "too few surgeries";
  EXPECT_FALSE(check(surgeries(20, 15000, 0.25, 0.25), "paper, the paper").pass)
      << "nothing by the paper's prior";
}

TEST(BenchChecks, TimesAreInUnitsOfTheSolveOfTheSameReport) {
  Results results;
  results.runs["sag-progress"] = run_with(4.0, 10.0, 400);
  results.runs["sag-progress@Haswell"] = run_with(5.0, 10.0, 400);
  results.runs["region"] = run_with(2.0, 10.0, 0);
  results.runs["no-contact"] = run_with(4.0, 10.0, 0);
  results.runs["cold-1"] = run_with(6.0, 10.0, 501);
  results.runs["cold-2"] = run_with(7.0, 10.0, 900);
  results.runs["cold-3"] = run_with(50.0, 10.0, 900);
  results.runs["cold-1@Haswell"] = run_with(1.0, 10.0, 500);
  const auto all = checks(results, "out");
  EXPECT_DOUBLE_EQ(named(all, "warm update with contact").value, 0.4);
  EXPECT_TRUE(named(all, "warm update with contact").pass);
  const Check& other = named(all, "warm update with contact, p50 / t_solve, BLAS kernel Haswell");
  EXPECT_DOUBLE_EQ(other.value, 0.5);
  EXPECT_FALSE(other.pass);
  EXPECT_FALSE(named(all, "region of 40 mm").pass) << "nothing pressed";
  EXPECT_DOUBLE_EQ(named(all, "first update").value, 1.4) << "the median of three sessions";
  EXPECT_TRUE(named(all, "first update").pass);
  EXPECT_FALSE(named(all, "median / t_solve, BLAS kernel Haswell").pass) << "too few press";
  EXPECT_FALSE(named(all, "update without contact").pass) << "0.4 is above 0.2";
}

TEST(BenchChecks, TailAndMemoryNeedTheirNumberOfUpdates) {
  Results results;
  results.latency_ms["sag-progress"].assign(1999, 5.0);
  results.facts = {{"rss_before_bytes", 1e9}, {"rss_after_bytes", 1e9}, {"growth_updates", 10000}};
  auto all = checks(results, "out");
  EXPECT_TRUE(named(all, "p99").pass);
  EXPECT_TRUE(named(all, "growth").pass);
  results.latency_ms["sag-progress"].pop_back();
  results.facts["growth_updates"] = 9999;
  all = checks(results, "out");
  EXPECT_FALSE(named(all, "p99").pass);
  EXPECT_FALSE(named(all, "growth").pass);
}

TEST(BenchChecks, CoverageIsTheMeanOverAllSurgeriesOfTheMethod) {
  const auto check = [](const std::string& coverages) {
    std::string rows = kHeading;
    std::istringstream list(coverages);
    int repetition = 0;
    for (std::string one; list >> one;) {
      rows += "18k,18000,paper,condensed,case,116,cold," + std::to_string(++repetition) +
              ",20,2,0.2,0.3,1.0,88,11,9,converged," + one + ",10\n";
    }
    return named(checks(results_of(rows), "out"), "within the 90 % interval");
  };
  EXPECT_DOUBLE_EQ(check("0.75 1.0").value, 0.875);
  EXPECT_TRUE(check("0.75 1.0").pass);
  EXPECT_FALSE(check("0.75 0.8").pass);
  EXPECT_FALSE(check("0.97 1.0").pass);
}

TEST(BenchChecks, AMeshThatIsLeftOutIsNotChecked) {
  Results results;
  const std::size_t all = checks(results, "out").size();
  results.left_out = {"mesh of 100 thousand nodes: not among SIZES=5,18"};
  const auto fewer = checks(results, "out");
  EXPECT_EQ(fewer.size(), all - 3);
  EXPECT_NE(to_json(fewer, results.left_out).find("not among SIZES=5,18"), std::string::npos);
}

TEST(BenchChecks, WhatIsLeftOutChangesNoMoreThanItsEstimate) {
  Results results;
  const std::string heading = "scenario,left_out,difference_mm,estimate_mm\n";
  const auto check = [&](const std::string& rows) {
    results.scenes = *CsvTable::parse(heading + rows, "scenes");
    return named(checks(results, "out"), "leaving out");
  };
  EXPECT_TRUE(check("paper,contact,0.5,1.0\npaper,uncertainty,0.005,0\n").pass);
  EXPECT_DOUBLE_EQ(check("paper,contact,0.5,1.0\n").value, 0.5);
  EXPECT_FALSE(check("paper,contact,0.5,1.0\npaper,far_field,0.5,0.4\n").pass);
}

TEST(BenchResults, ReadsWhatTheScriptLeavesBehind) {
  const test_support::TemporaryFolder folder;
  std::ofstream(folder.path() / "machine.txt") << "a processor; commit abc\n";
  std::ofstream(folder.path() / "left_out.csv") << "this\nand that\n";
  std::ofstream(folder.path() / "stages.csv")
      << "surgery,stage,p50_ms,over_tsolve,times\nshort,contact,3,0.3,2\n";
  const auto results = read_results(folder.path());
  ASSERT_TRUE(results) << results.error().message;
  EXPECT_EQ(results->left_out.size(), 2u);
  const std::string text = tables(*results, checks(*results, "out"));
  EXPECT_NE(text.find("a processor; commit abc"), std::string::npos);
  EXPECT_NE(text.find("| contact | 0.3 |"), std::string::npos) << text;
  EXPECT_NE(text.find("- and that"), std::string::npos);
}

TEST(BenchResults, ReadsTheLargestRankOfTheComparisonWithTheDirectPosterior) {
  const test_support::TemporaryFolder folder;
  std::ofstream(folder.path() / "direct-distension.json") << R"({"exact_max_mm": 1e-9,
             "reduced": [{"rank": 32, "max_mm": 0.5}, {"rank": 128, "max_mm": 0.002}]})";
  std::ofstream(folder.path() / "prepare.json")
      << R"({"total_s": 12.5, "mesh": {"nodes": 7}, "peak_memory_bytes": 100})";
  std::ofstream(folder.path() / "prepare-100k.json") << R"({"total_s": 340, "mesh": {}})";
  const auto results = read_results(folder.path());
  ASSERT_TRUE(results) << results.error().message;
  EXPECT_DOUBLE_EQ(results->fact("direct_max_mm distension"), 0.002);
  EXPECT_DOUBLE_EQ(results->fact("exact_max_mm distension"), 1e-9);
  EXPECT_TRUE(std::isnan(results->fact("direct_max_mm paper")));
  EXPECT_DOUBLE_EQ(results->fact("prepare_s"), 12.5);
  EXPECT_TRUE(std::isnan(results->fact("model_file_bytes")));
  EXPECT_DOUBLE_EQ(results->fact("large_prepare_s"), 340.0);
  std::ofstream(folder.path() / "direct-paper.json") << "[";
  EXPECT_EQ(read_results(folder.path()).error().code, ErrorCode::kUnreadable);
  EXPECT_EQ(read_results(folder.path() / "none").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::bench
