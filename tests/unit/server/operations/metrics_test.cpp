// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/metrics.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "server/operations/counters.hpp"
#include "tests/support/results.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// What a monitor reads of the text format of Prometheus, as strictly as it may.
struct Exposition {
  std::map<std::string, std::string> types;  // by family
  std::set<std::string> helped;
  std::map<std::string, double> samples;  // by name with its labels, as they stand there

  double value(const std::string& sample) const {
    const auto found = samples.find(sample);
    EXPECT_NE(found, samples.end()) << sample;
    return found == samples.end() ? -1.0 : found->second;
  }
};

Exposition read_exposition(const std::string& text) {
  Exposition result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string sign, kind, family;
    if (line.rfind("# ", 0) == 0) {
      words >> sign >> kind >> family;
      if (kind == "HELP") {
        EXPECT_TRUE(result.helped.insert(family).second) << line;
      }
      if (kind == "TYPE") {
        EXPECT_EQ(result.types.count(family), 0u) << line;
        words >> result.types[family];
      }
      continue;
    }
    const std::size_t blank = line.rfind(' ');
    EXPECT_NE(blank, std::string::npos) << line;
    const std::string number = line.substr(blank + 1);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    EXPECT_EQ(*end, '\0') << line;
    EXPECT_TRUE(result.samples.emplace(line.substr(0, blank), value).second) << line;
  }
  return result;
}

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
                                              "brainshift_field_aged",
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

TEST(Metrics, SayWhetherTheFieldIsAgedOrHasExpired) {
  wire::DaemonReport report = sample_report();
  report.session.aged_after_ms = 2000;
  report.session.expired_after_ms = 4000;
  for (const double state : {0.0, 1.0, 2.0}) {
    report.session.age_ms = 1000.0 + 2000.0 * state;
    EXPECT_EQ(exposition_of(report).value("brainshift_field_aged"), state);
  }
}

TEST(Metrics, WhatIsNotThereIsLeftOut) {
  const Exposition read = exposition_of({});
  for (const char* absent : {"brainshift_field_age_seconds", "brainshift_journal_recording",
                             "brainshift_observations_total", "brainshift_stage_recent_seconds"}) {
    EXPECT_EQ(read.types.count(absent), 0u) << absent;
  }
  EXPECT_EQ(read.value("brainshift_journal_configured"), 0.0);
}

// ---------- real scrapes, over loopback ----------

// A socket; -1 when nobody listens.
int connect_to(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  timeval limit{10, 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  close(fd);
  return -1;
}

std::string exchange(int port, const std::string& request) {
  const int fd = connect_to(port);
  std::string answer;
  if (send(fd, request.data(), request.size(), MSG_NOSIGNAL) > 0) {
    std::array<char, 4096> buffer{};
    ssize_t size = 0;
    while ((size = recv(fd, buffer.data(), buffer.size(), 0)) > 0) {
      answer.append(buffer.data(), static_cast<std::size_t>(size));
    }
  }
  close(fd);
  return answer;
}

std::string scrape(int port) {
  return exchange(port, "GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
}

std::string body_of(const std::string& answer) {
  const std::size_t end = answer.find("\r\n\r\n");
  return end == std::string::npos ? std::string() : answer.substr(end + 4);
}

TEST(MetricsExporter, EveryScrapeMakesAReportAndIsReadable) {
  std::atomic<int> asked = 0;
  auto exporter = value_or_fail(MetricsExporter::listen("127.0.0.1:0", [&] {
    wire::DaemonReport report;
    report.uptime_ms = static_cast<std::uint64_t>(1000 * ++asked);
    return report;
  }));
  for (int scraped = 1; scraped <= 3; ++scraped) {
    const std::string answer = scrape(exporter.port());
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(answer, HasSubstr("text/plain; version=0.0.4"));
    const Exposition read = read_exposition(body_of(answer));
    EXPECT_EQ(read.value("brainshift_uptime_seconds"), scraped);
  }
  EXPECT_EQ(asked, 3);
}

TEST(MetricsExporter, APortThatIsTakenIsNamedInOneLine) {
  const auto first =
      value_or_fail(MetricsExporter::listen("127.0.0.1:0", [] { return wire::DaemonReport(); }));
  const std::string taken = "127.0.0.1:" + std::to_string(first.port());
  EXPECT_THAT(refusal_of(MetricsExporter::listen(taken, [] { return wire::DaemonReport(); }),
                         ErrorCode::kInvalidArgument),
              testing::AllOf(StartsWith("metrics.endpoint = " + taken),
                             testing::Not(testing::HasSubstr("\n"))));
}

TEST(MetricsExporter, WhatIsNoAddressIsRefused) {
  for (const char* endpoint :
       {"", "9464", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "host:1", "127.0.0.1:1x"}) {
    EXPECT_FALSE(MetricsExporter::listen(endpoint, [] { return wire::DaemonReport(); }))
        << endpoint;
  }
}

TEST(MetricsExporter, OtherPathsAndGarbageAreNoReport) {
  std::atomic<int> asked = 0;
  auto exporter = value_or_fail(MetricsExporter::listen("127.0.0.1:0", [&] {
    ++asked;
    return wire::DaemonReport();
  }));
  const std::string answer =
      exchange(exporter.port(), "GET /etc/passwd HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(
      exchange(exporter.port(), "DELETE /metrics HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"),
      StartsWith("HTTP/1.1 405"));
  exchange(exporter.port(), std::string(5000, '\xff') + "\r\n\r\n");
  EXPECT_EQ(asked, 0);
  EXPECT_THAT(scrape(exporter.port()), StartsWith("HTTP/1.1 200"));
}

TEST(MetricsExporter, MonitorsThatAskAtOnceAreAllAnswered) {
  std::atomic<int> inside = 0, most = 0;
  auto exporter = value_or_fail(MetricsExporter::listen("127.0.0.1:0", [&] {
    most = std::max(most.load(), ++inside);
    const wire::DaemonReport report;
    --inside;
    return report;
  }));
  std::atomic<int> answered = 0;
  {
    std::vector<std::jthread> monitors;
    for (int i = 0; i < 8; ++i) {
      monitors.emplace_back(
          [&] { answered += scrape(exporter.port()).rfind("HTTP/1.1 200", 0) == 0 ? 1 : 0; });
    }
  }
  EXPECT_EQ(answered, 8);
  EXPECT_EQ(most, 1) << "one report at a time";
}

TEST(MetricsExporter, QuestionsThatNeverEndKeepNoMonitorOut) {
  auto exporter =
      value_or_fail(MetricsExporter::listen("127.0.0.1:0", [] { return wire::DaemonReport(); }));
  std::vector<int> dripping;
  for (int i = 0; i < 40; ++i) {
    dripping.push_back(connect_to(exporter.port()));
    ASSERT_EQ(send(dripping.back(), "GET /me", 7, MSG_NOSIGNAL), 7);
  }
  EXPECT_THAT(scrape(exporter.port()), StartsWith("HTTP/1.1 200"));
  for (const int fd : dripping) close(fd);
}

TEST(Metrics, ANameOfASourceDrivesNoTerminal) {
  wire::DaemonReport report;
  report.sources.emplace_back().source = "a\x1b[2J\nb";
  const std::string text = prometheus::TextSerializer().Serialize(metric_families(report));
  EXPECT_THAT(text, HasSubstr("source=\"a?[2J?b\""));
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace brainshift::server
