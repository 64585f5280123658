// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <prometheus/text_serializer.h>

#include <regex>
#include <set>
#include <string>

#include "server/operations/counters.hpp"
#include "tests/unit/server/operations/exposition.hpp"

namespace brainshift::server {
namespace {

wire::DaemonReport sample_report() {
  wire::DaemonReport report;
  report.version = "1.2.3";
  report.model_ready = true;
  report.session.phase = SessionPhase::kDegraded;
  report.session.newest_update = 5;
  report.session.newest_usable = 4;
  report.session.age_ms = 1250.0;
  report.viewers = {{"00", 1, 9, 8, 1, 0}, {"01", 1, 9, 9, 0, 0}};
  report.clients = 3;
  report.journal = wire::JournalFigures{false, "disk full", "j", 4096, 7, 2};
  report.door = {90, 1, 2, 3, 4, 4096, 5, 6, 7, 8, 9};
  Counters counters;
  const Counters::TimePoint now{std::chrono::seconds(9)};
  for (const char* source : {"ius", "a \"quoted\\\" one"}) counters.accepted(source, now);
  counters.refused("ius", now);
  for (const double total_ms : {0.05, 0.1, 30.0, 2e5}) {
    Passage passage;
    passage.published = passage.arrived + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double, std::milli>(total_ms));
    passage.usable = true;
    passage.late = total_ms > 100.0;
    counters.answered(passage);
  }
  counters.report(report, now);
  return report;
}

Exposition exposition_of(const wire::DaemonReport& report) {
  const prometheus::TextSerializer serializer;
  return read_exposition(serializer.Serialize(metric_families(report)));
}

TEST(Metrics, CarryWhatTheReportSaysInSecondsAndBytes) {
  const Exposition read = exposition_of(sample_report());
  EXPECT_EQ(read.value("brainshift_model_ready"), 1.0);
  EXPECT_EQ(read.value("brainshift_session_phase{phase=\"degraded\"}"), 1.0);
  EXPECT_EQ(read.value("brainshift_session_phase{phase=\"tracking\"}"), 0.0);
  EXPECT_EQ(read.value("brainshift_field_age_seconds"), 1.25);
  EXPECT_EQ(read.value("brainshift_updates_total{result=\"usable\"}"), 4.0);
  EXPECT_EQ(read.value("brainshift_updates_late_total"), 1.0);
  EXPECT_EQ(read.value("brainshift_observations_received_total{source=\"ius\"}"), 2.0);
  EXPECT_EQ(read.value("brainshift_observations_total{source=\"ius\",outcome=\"refused\"}"), 1.0);
  EXPECT_EQ(read.value("brainshift_observations_waiting{source=\"a \\\"quoted\\\\\\\" one\"}"),
            1.0);
  EXPECT_EQ(read.value("brainshift_viewers_behind"), 1.0);
  EXPECT_EQ(read.value("brainshift_connections_accepted_total"), 90.0);
  EXPECT_EQ(read.value("brainshift_connections_closed_total{reason=\"memory\"}"), 2.0);
  EXPECT_EQ(read.value("brainshift_connections_closed_total{reason=\"silence\"}"), 3.0);
  EXPECT_EQ(read.value("brainshift_refusals_total{reason=\"unknown_key\"}"), 5.0);
  EXPECT_EQ(read.value("brainshift_refusals_total{reason=\"session_starts\"}"), 9.0);
  EXPECT_EQ(read.value("brainshift_held_bytes"), 4096.0);
  EXPECT_EQ(read.value("brainshift_journal_recording"), 0.0);
  EXPECT_EQ(read.value("brainshift_journal_bytes"), 4096.0);
}

TEST(Metrics, EveryFamilyHasHelpATypeAndAUnitInItsName) {
  const Exposition read = exposition_of(sample_report());
  const std::set<std::string> without_unit = {"brainshift_build_info",
                                              "brainshift_model_ready",
                                              "brainshift_worker_hangs",
                                              "brainshift_session_phase",
                                              "brainshift_clients",
                                              "brainshift_viewers",
                                              "brainshift_viewers_behind",
                                              "brainshift_journal_configured",
                                              "brainshift_journal_recording",
                                              "brainshift_open_descriptors",
                                              "brainshift_max_descriptors",
                                              "brainshift_threads",
                                              "brainshift_journal_records",
                                              "brainshift_journal_lost_records",
                                              "brainshift_observations_waiting"};
  const std::regex with_unit("brainshift_[a-z_]+_(seconds|bytes|total)");
  for (const auto& [family, type] : read.types) {
    EXPECT_EQ(read.helped.count(family), 1u) << family;
    EXPECT_TRUE(without_unit.count(family) == 1 || std::regex_match(family, with_unit)) << family;
    EXPECT_EQ(type == "counter", family.size() > 6 && family.substr(family.size() - 6) == "_total")
        << family;
  }
}

TEST(Metrics, HistogramsAreCumulativeAndAgreeWithTheirCount) {
  const Exposition read = exposition_of(sample_report());
  const auto bucket = [&](const std::string& bound) {
    return read.value("brainshift_stage_seconds_bucket{stage=\"total\",le=\"" + bound + "\"}");
  };
  EXPECT_EQ(bucket("0.0001"), 2.0);
  EXPECT_EQ(bucket("0.02"), 2.0);
  EXPECT_EQ(bucket("0.05"), 3.0);
  EXPECT_EQ(bucket("100"), 3.0);
  EXPECT_EQ(bucket("+Inf"), 4.0);
  EXPECT_EQ(read.value("brainshift_stage_seconds_count{stage=\"total\"}"), 4.0);
  EXPECT_NEAR(read.value("brainshift_stage_seconds_sum{stage=\"total\"}"), 200.03015, 1e-4);
}

TEST(Metrics, WhatIsNotThereIsLeftOut) {
  const Exposition read = exposition_of({});
  for (const char* absent : {"brainshift_field_age_seconds", "brainshift_journal_recording",
                             "brainshift_observations_total", "brainshift_stage_recent_seconds"}) {
    EXPECT_EQ(read.types.count(absent), 0u) << absent;
  }
  EXPECT_EQ(read.value("brainshift_journal_configured"), 0.0);
}

}  // namespace
}  // namespace brainshift::server
