// SPDX-License-Identifier: Apache-2.0
#include "common/wire/report.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <limits>

namespace brainshift::wire {
namespace {

using testing::HasSubstr;

DaemonReport sample_report() {
  DaemonReport report;
  report.version = "1.2.3";
  report.model_ready = true;
  report.session.session = {7, 2, "0123456789abcdef"};
  report.session.phase = SessionPhase::kTracking;
  report.session.newest_update = report.session.newest_usable = 4;
  report.session.age_ms = 0.1;
  report.sources = {{"ius", 10, 1, 2, 3, 0, 1, 1, 2, 1.0 / 3.0}, {"", 1, 0, 0, 0, 0, 1, 0, 0, 0}};
  report.viewers = {{"00ff", 256, 9, 7, 1, 2}};
  report.recent_updates = 2048;
  report.bounds_ms = {0.1, 1.0};
  report.stages = {{"total", {1, 2.0, 3.0, 4.0, 5.0}, {}, 2.0, {0, 0, 1}}};
  report.journal = JournalFigures{false, "disk full", "j.surgery", 1, 2, 3};
  report.process = {1, 2, 3, 4, 5};
  return report;
}

void expect_report_refused(const DaemonReport& report, ErrorCode code, const char* field) {
  EXPECT_THAT(refusal_of(decode_report(encode(report)), code), HasSubstr(field));
}

TEST(Report, IsReproducedWithAndWithoutAJournal) {
  DaemonReport report = sample_report();
  auto decoded = decode_report(encode(report));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(*decoded, report);
  report.journal.reset();
  decoded = decode_report(encode(report));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(*decoded, report);
}

TEST(Report, NumbersThatCannotBeAreRefusedNamingTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  DaemonReport report = sample_report();
  report.sources[0].age_ms = nan;
  expect_report_refused(report, ErrorCode::kNotFinite, "report.sources.age_ms");
  report = sample_report();
  report.stages[0].all.p99_ms = -1.0;
  expect_report_refused(report, ErrorCode::kProtocol, "report.stages.p99_ms");
  report = sample_report();
  report.bounds_ms = {1.0, 1.0};
  expect_report_refused(report, ErrorCode::kProtocol, "report.bounds_ms");
  report = sample_report();
  report.stages[0].bucket_counts.pop_back();
  expect_report_refused(report, ErrorCode::kProtocol, "report.stages.bucket_counts");
}

// A report is printed on terminals.
TEST(Report, TextOfAPeerCannotDriveATerminal) {
  DaemonReport report = sample_report();
  report.sources[0].source = "i\033[2Jus";
  report.journal->reason = "a\nb";
  const auto decoded = value_or_fail(decode_report(encode(report)));
  EXPECT_EQ(decoded.sources[0].source, "i [2Jus");
  EXPECT_EQ(decoded.journal->reason, "a b");
}

TEST(Report, AnEmptyPayloadIsNoReport) { EXPECT_FALSE(decode_report("")); }

}  // namespace
}  // namespace brainshift::wire
