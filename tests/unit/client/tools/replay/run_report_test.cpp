// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/run_report.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/support/report_keys.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

RunReport full_run() {
  RunReport run;
  run.case_id = "colin27";
  run.scenario = "paper";
  run.method = "paper";
  run.boundary = "contact";
  run.seed = 18446744073709551615u;
  run.mesh = {18070, 100842, 1190};
  run.prepare_s = 4.5;
  run.model_bytes = 414671272;
  run.full_solve_ms = 33.25;
  run.updates = 2;
  run.latency_ms = LatencyPercentiles{1, 2, 3, 4};
  run.cold_ms = 4.0;
  run.stages_ms = StageTimings{0.5, 100, 0, 1, 0.25};
  run.error_mm.initial = MeanStd{2.9, 0.67};
  run.error_mm.cross = MeanStd{0.11, 0.07};
  run.recovery_pct = 96.2;
  run.tumour_shift_mm = TumourShift{2.3, std::nullopt};
  run.course = {{1.5, "ius", "caution", "a", 2.3, 0.2, std::nullopt, 0.3, 80.0}};
  run.leave_one_out = {
      {"tracks", "landmarks", 13, 1, {5.8, 1}, MeanStd{1.7, 0.5}, {1.6, 0.7}, 0.9}};
  run.field_error_pct = FieldError{1, 5, 9};
  run.contact = ContactSummary{400, 3, 0.04, 6};
  run.principal_direction_deg = 3.1;
  run.region_known = 0.75;
  run.truth_scalars["fluid_level_mm"] = 40.0;
  run.left_out = {{"pressure", "drained", "0.02 %"}};
  run.sources = {{"ius", 41, 0.25, 200, 3, 31.5, 28.75, 0.125, true}, {"stereopsis", 40, 2.0, 300}};
  run.sources[1].consistent = false;
  run.quality = RunQuality{"unusable",
                           "caution",
                           "the time ran out",
                           {5, 2, 1, 0},
                           {{"deadline", 2}, {"inverted_elements", 1}}};
  run.prior_strengths = {{"along_gravity", 1.25, 0.5, false}, {"other", 3.0, 0.0, true}};
  run.hypotheses = {{{{"along_gravity", 2.5}, {"other", 3.0}}, 0.75},
                    {{{"along_gravity", 0.0}, {"other", 3.0}}, 0.25}};
  run.failures = {{3, "unavailable", "no update \"in\" time"}};
  run.trace = {{1, {2.0, 0.5}, MeanStd{1.9, 0.4}, 12, 0.3, 100.0},
               {2, {1.0, 0.5}, std::nullopt, 2, 0.1, 200.0}};
  return run;
}

TEST(RunReport, ReadsBackWhatItWrote) {
  const std::string text = to_json({full_run(), RunReport{}});
  // The empty run lacks nothing: its required keys are there, as empty strings.
  const auto read = value_or_fail(from_json(text, "R.json"));
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(to_json(read), text);
  EXPECT_EQ(read[0].seed, full_run().seed);
  EXPECT_EQ(read[0].trace[0].cross->mean, 1.9);
  EXPECT_FALSE(read[0].trace[1].cross);
  ASSERT_EQ(read[0].sources.size(), 2u);
  EXPECT_EQ(read[0].sources[0].p_value, 0.125);
  EXPECT_TRUE(std::isnan(read[0].sources[1].p_value));
  EXPECT_FALSE(read[0].sources[1].consistent);
}

TEST(RunReport, HasEveryKeyOfTheContract) {
  const json run = json::parse(to_json({full_run()}))[0];
  for (const char* key : test_support::kReportKeys) EXPECT_TRUE(run.contains(key)) << key;
  const auto keys_of = [&](const char* object, std::initializer_list<const char*> keys) {
    for (const char* key : keys) EXPECT_TRUE(run[object].contains(key)) << object << "." << key;
  };
  keys_of("mesh", {"nodes", "tets", "slaves"});
  keys_of("latency_ms", {"p50", "p95", "p99", "max"});
  keys_of("stages_ms", {"register", "invert", "rebuild", "encode", "journal"});
  keys_of("error_mm", {"initial", "sparse", "cross", "craniotomy_initial", "craniotomy"});
  keys_of("field_error_pct", {"p50", "p99", "max"});
  keys_of("contact", {"active", "penetrating", "max_penetration_mm", "iterations"});
  keys_of("quality", {"worst", "last", "reason", "counts", "flags"});
  EXPECT_EQ(run["quality"]["counts"],
            (json{{"good", 5}, {"caution", 2}, {"unusable", 1}, {"not_judged", 0}}));
  EXPECT_EQ(run["quality"]["flags"], (json{{"deadline", 2}, {"inverted_elements", 1}}));
  EXPECT_EQ(run["prior_strengths"][1],
            (json{{"part", "other"}, {"mean", 3.0}, {"absent", 0.0}, {"at_bound", true}}));
  EXPECT_EQ(run["hypotheses"][0]["scales"]["along_gravity"], 2.5);
  EXPECT_EQ(run["hypotheses"][0]["weight"], 0.75);
  EXPECT_TRUE(run["left_out"][0].contains("estimated_error"));
  EXPECT_EQ(run["error_mm"]["initial"]["mean"], 2.9);
  EXPECT_EQ(run["region_known"], 0.75);
}

TEST(RunReport, NotApplicableAndNotFiniteAreNull) {
  RunReport run = full_run();
  run.recovery_pct = std::numeric_limits<double>::quiet_NaN();
  run.error_mm.cross = MeanStd{0.1, std::numeric_limits<double>::infinity()};
  const std::string text = to_json({run});
  const json object = json::parse(text)[0];
  EXPECT_TRUE(object["coverage_90"].is_null());
  EXPECT_TRUE(object["recovery_pct"].is_null());
  EXPECT_TRUE(object["error_mm"]["cross"]["std"].is_null());
  const auto read = value_or_fail(from_json(text, "R.json"));
  EXPECT_TRUE(std::isnan(read[0].error_mm.cross->std));
}

TEST(RunReport, OfAnOlderWriterHasNoQuality) {
  json runs = json::parse(to_json({full_run()}));
  for (const char* key : {"quality", "prior_strengths", "hypotheses"}) runs[0].erase(key);
  const auto read = value_or_fail(from_json(runs.dump(), "R.json"));
  EXPECT_FALSE(read[0].quality);
  EXPECT_TRUE(read[0].prior_strengths.empty());
  EXPECT_TRUE(read[0].hypotheses.empty());
}

TEST(RunReport, IgnoresKeysOfNewerWriters) {
  json runs = json::parse(to_json({full_run()}));
  runs[0]["invented_later"] = {{"a", 1}};
  EXPECT_TRUE(from_json(runs.dump(), "R.json"));
}

struct BadReport {
  const char* name;
  const char* pointer;  // JSON pointer of what is replaced
  const char* value;
  const char* expected;
};
class MalformedReport : public testing::TestWithParam<BadReport> {};

TEST_P(MalformedReport, IsRefusedInOneLineNamingTheKey) {
  json runs = json::parse(to_json({full_run()}));
  runs[json::json_pointer(GetParam().pointer)] = json::parse(GetParam().value);
  EXPECT_THAT(refusal_of(from_json(runs.dump(), "R.json"), ErrorCode::kUnreadable),
              testing::AllOf(HasSubstr("R.json"), HasSubstr(GetParam().expected),
                             testing::Not(HasSubstr("\n"))));
}
INSTANTIATE_TEST_SUITE_P(
    Keys, MalformedReport,
    testing::Values(
        BadReport{"number", "/0/error_mm/cross/mean", "\"small\"", "[0].error_mm.cross.mean"},
        BadReport{"string", "/0/case", "7", "[0].case"},
        BadReport{"null", "/0/scenario", "null", "[0].scenario"},
        BadReport{"object", "/0/latency_ms", "[1, 2]", "[0].latency_ms"},
        BadReport{"array", "/0/trace", "{}", "[0].trace"},
        BadReport{"element", "/0/trace/1/iteration", "1.5", "[0].trace[1].iteration"},
        BadReport{"negative", "/0/seed", "-1", "[0].seed"},
        BadReport{"count", "/0/quality/counts/good", "\"all\"", "[0].quality.counts.good"},
        BadReport{"flags", "/0/quality/flags", "[\"deadline\"]", "[0].quality.flags"},
        BadReport{"flag", "/0/quality/flags/deadline", "1.5", "[0].quality.flags.deadline"},
        BadReport{"strength", "/0/prior_strengths/0/mean", "true", "[0].prior_strengths[0].mean"},
        BadReport{"weight", "/0/hypotheses/1/weight", "{}", "[0].hypotheses[1].weight"},
        BadReport{"run", "/0", "3", "[0]"}),
    [](const auto& param) { return param.param.name; });

TEST(RunReport, MissingRequiredKeyIsNamed) {
  json runs = json::parse(to_json({full_run()}));
  runs[0].erase("boundary");
  EXPECT_THAT(sentence_of(from_json(runs.dump(), "R.json")), HasSubstr("boundary"));
}

TEST(RunReport, TextThatIsNoArrayOfRunsIsRefused) {
  for (const char* text : {"", "{", "{}", "[1]", "null", "[{}]\n]"}) {
    EXPECT_THAT(refusal_of(from_json(text, "R.json"), ErrorCode::kUnreadable), Not(HasSubstr("\n")))
        << text;
  }
}

TEST(ReportFile, MissingFolderAndUnwritablePlacesAreNamed) {
  const test_support::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  EXPECT_THAT(refusal_of(read_reports(folder / "no-such-report.json"), ErrorCode::kNotFound),
              HasSubstr("no-such-report.json"));
  refusal_of(read_reports(folder), ErrorCode::kUnreadable);
  EXPECT_THAT(refusal_of(write_reports(folder / "no-such-folder" / "R.json", {full_run()}),
                         ErrorCode::kWriteFailed),
              HasSubstr("no-such-folder"));
}

TEST(ReportFile, ReplacesTheOldOneAndLeavesNoTemporaryFile) {
  const test_support::TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  std::ofstream(folder / "R.json") << "old";
  ASSERT_TRUE(write_reports(folder / "R.json", {full_run()}));
  const auto read = value_or_fail(read_reports(folder / "R.json"));
  EXPECT_EQ(read.size(), 1u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
}

}  // namespace
}  // namespace brainshift::client
