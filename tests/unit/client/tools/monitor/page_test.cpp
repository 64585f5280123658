// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "client/tools/monitor/page.hpp"
#include "tests/unit/client/tools/monitor/sample_report.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;
using wire::DaemonReport;

std::string text_of(const DaemonReport& report) {
  std::string text;
  for (const Line& line : page({report, std::nullopt}, "tcp://127.0.0.1:5555")) {
    text += line.text + "\n";
  }
  return text;
}

// Its one line that holds this text.
Line line_with(const Reports& reports, const std::string& text) {
  for (const Line& line : page(reports, "e")) {
    if (line.text.find(text) != std::string::npos) return line;
  }
  ADD_FAILURE() << "no line with " << text;
  return {};
}

TEST(Page, HoldsWhatTheReportHolds) {
  const std::string text = text_of(sample_report());
  for (const char* part :
       {"1.2.3 at tcp://127.0.0.1:5555, up 1 h 2 min", "verdict   well",
        "case colin27, model 0123456789abcdef", "tracking, session 3, owner 00ab12cd34",
        "update 812, 0.2 s old", "812 usable, 1 unusable, 3 failed, 6 late",
        "2 connected, 1 of them view", "window 1, sent 800, received 799, owed 1", "recording",
        "/j/colin27-3.surgery, 8.0 MiB", "2500 records, 0 lost", "0 lines lost",
        "90 accepted, closed for breach 1, memory 2, silence 3, room 4, 5.0 MiB held",
        "unknown keys 6, beyond a role 7, connections 8, observations 9, session starts 10",
        "120.0 MiB resident, 140.0 MiB at most", "31 of 1024 descriptors, 9 threads",
        "(not known)"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, testing::ContainsRegex("total +31.50 +40.25 +55.00 +90.12 +31.00 +40.00"));
  EXPECT_THAT(text, testing::ContainsRegex("ius +900 +813 +3 +80 +0 +4 +0 +0  0.0 s ago"));
}

TEST(Page, NothingOfADaemonThatFaresWellIsAlarming) {
  for (const Line& line : page({sample_report(), std::nullopt}, "e")) {
    EXPECT_FALSE(line.alarm) << line.text;
  }
}

TEST(Page, OfADaemonThatHasJustStartedIsReadable) {
  const std::string text = text_of({});
  EXPECT_THAT(text, HasSubstr("NONE is loaded"));
  EXPECT_THAT(text, HasSubstr("no update yet"));
  EXPECT_THAT(text, HasSubstr("none has observed yet"));
  EXPECT_THAT(text, HasSubstr("none is configured"));
}

TEST(Page, AJournalWithoutASessionHasNothingToRecord) {
  DaemonReport report = sample_report();
  report.session = {};
  report.journal = wire::JournalFigures();
  EXPECT_FALSE(line_with({report, std::nullopt}, "journal   waits for a session").alarm);
}

// Each stands in words: nothing depends on colour.
TEST(Page, WhatNeedsAttentionStandsInCapitalsAndAlarms) {
  const std::pair<const char*, std::function<void(DaemonReport&)>> kFaults[] = {
      {", AGED", [](DaemonReport& report) { report.session.age_ms = 30'001.0; }},
      {", EXPIRED", [](DaemonReport& report) { report.session.age_ms = 600'001.0; }},
      {"ATTENTION: the field is aged: its data are 30.1 s old: 30 s at most",
       [](DaemonReport& report) { report.session.age_ms = 30'100.0; }},
      {"RECORDED, well", [](DaemonReport& report) { report.session.recorded = true; }},
      {"session 3, owner 00ab12cd34, RECORDED, condensed, contact",
       [](DaemonReport& report) { report.session.recorded = true; }},
      {"NOT RECORDING: disk full",
       [](DaemonReport& report) {
         report.journal->recording = false;
         report.journal->reason = "disk full";
       }},
      {"HANGS: at most 13.0 s", [](DaemonReport& report) { report.working_ms = 13'001.0; }},
      {"ATTENTION: no model is loaded", [](DaemonReport& report) { report.model_ready = false; }},
      {"1 lost", [](DaemonReport& report) { report.journal->lost = 1; }},
      {"5 lines lost", [](DaemonReport& report) { report.log_lines_lost = 5; }},
  };
  for (const auto& [words, spoil] : kFaults) {
    DaemonReport report = sample_report();
    spoil(report);
    EXPECT_TRUE(line_with({report, std::nullopt}, words).alarm) << words;
  }
}

TEST(Page, RatesAreThoseBetweenTwoReports) {
  DaemonReport before = sample_report();
  DaemonReport now = before;
  now.uptime_ms += 2000;
  now.usable += 60;
  now.failures += 1;
  now.sources[0].received += 70;
  now.sources.push_back({"new", 5, 5, 0, 0, 0, 0, 0, 0, 0.0});
  const Reports reports{now, before};
  EXPECT_THAT(line_with(reports, "usable").text, HasSubstr("30.5/s"));
  EXPECT_THAT(line_with(reports, "ius").text, HasSubstr("35.0/s"));
  EXPECT_THAT(line_with(reports, "new").text, HasSubstr("2.5/s"));
}

TEST(Page, AReportOfAnotherProcessGivesNoRates) {
  DaemonReport before = sample_report();
  DaemonReport now = before;
  now.uptime_ms += 2000;
  now.session.session.boot_id += 1;
  EXPECT_THAT(line_with({now, before}, "usable").text, Not(HasSubstr("/s")));
}

TEST(Complaint, IsEmptyWhileASessionTracksOrIsReadyAndIsRecorded) {
  DaemonReport report = sample_report();
  EXPECT_EQ(complaint(report), std::nullopt);
  report.session.phase = SessionPhase::kReady;
  EXPECT_EQ(complaint(report), std::nullopt);
  report.journal.reset();
  EXPECT_EQ(complaint(report), std::nullopt) << "no journal is configured";
}

TEST(Complaint, NamesWhatIsWrong) {
  const std::pair<const char*, std::function<void(DaemonReport&)>> kFaults[] = {
      {"no model", [](DaemonReport& report) { report.model_ready = false; }},
      {"hangs", [](DaemonReport& report) { report.working_ms = 13'001.0; }},
      {"no session", [](DaemonReport& report) { report.session.phase = SessionPhase::kEmpty; }},
      {"prepared", [](DaemonReport& report) { report.session.phase = SessionPhase::kPreparing; }},
      {"stopping", [](DaemonReport& report) { report.session.phase = SessionPhase::kClosed; }},
      {"degraded: no point",
       [](DaemonReport& report) {
         report.session.phase = SessionPhase::kDegraded;
         report.session.reason = "no point";
       }},
      {"not recording: disk full", [](DaemonReport& report) {
         report.journal->recording = false;
         report.journal->reason = "disk full";
       }}};
  for (const auto& [words, spoil] : kFaults) {
    DaemonReport report = sample_report();
    spoil(report);
    const auto told = complaint(report);
    ASSERT_TRUE(told) << words;
    EXPECT_THAT(*told, HasSubstr(words));
    EXPECT_EQ(told->find('\n'), std::string::npos);
  }
}

TEST(Summary, IsOneLineWithPhaseAgeRateLatencyAndJournal) {
  DaemonReport before = sample_report();
  DaemonReport now = before;
  now.uptime_ms += 1000;
  now.usable += 30;
  EXPECT_EQ(
      summary({now, before}),
      "tracking, field 0.2 s old, condensed, contact, model 0123456789abcdef, 30.0 updates/s, "
      "total p50 31.50 p95 40.25 p99 55.00 max "
      "90.12 ms, recording");
}

TEST(DurationText, IsShortAndWithinItsLastDigit) {
  EXPECT_EQ(duration_text(0.0), "0.0 s");
  EXPECT_EQ(duration_text(59.9), "59.9 s");
  EXPECT_EQ(duration_text(60.0), "1 min 0 s");
  EXPECT_EQ(duration_text(3599.0), "59 min 59 s");
  EXPECT_EQ(duration_text(90061.0), "25 h 1 min");
}

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
