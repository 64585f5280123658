// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>

#include "client/tools/replay/replay.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

class ReplayInput : public testing::Test {
 protected:
  Error refused(int repeat = 1, Speed speed = Speed::kMax) const {
    ReplayOptions options;
    options.repeat = repeat;
    options.speed = speed;
    options.surgery = folder / "s.surgery";
    options.report = folder / "R.json";
    options.endpoint = "tcp://127.0.0.1:1";
    const Status status = replay(options);
    EXPECT_FALSE(status);
    EXPECT_FALSE(std::filesystem::exists(options.report));
    return status ? Error{} : status.error();
  }
  const test_support::TemporaryFolder folder;
};

// A surgery whose observations have these sequence numbers.
void record(const std::filesystem::path& path, const std::vector<std::uint64_t>& sequences) {
  auto file = io::SurgeryFile::create(path, io::SurgeryMeta{"box", "m"});
  ASSERT_TRUE(file);
  for (const std::uint64_t sequence : sequences) {
    Observation observation;
    observation.case_id = "box";
    observation.source = "ius";
    observation.sequence = sequence;
    observation.body = LandmarkPairs{Points::Random(3, 4), Points::Random(3, 4), 0.3};
    ASSERT_TRUE(
        file->append({io::RecordKind::kObservation, sequence, 0, wire::encode(observation)}));
  }
  ASSERT_TRUE(file->close());
}

TEST_F(ReplayInput, RepeatThatDoesNotFitIsRefused) {
  constexpr std::uint64_t kLargest = (std::uint64_t{1} << 63) - 1;
  record(folder / "s.surgery", {kLargest - 4, kLargest - 3});
  for (const int repeat : {0, -1, 3, 1000}) {
    const Error error = refused(repeat);
    EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.message, HasSubstr("repeat = " + std::to_string(repeat)));
  }
  const Error recorded_times = refused(2, Speed::kRecorded);
  EXPECT_EQ(recorded_times.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(recorded_times.message, HasSubstr("speed max"));
}

TEST_F(ReplayInput, MissingSurgeryIsNamed) {
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_THAT(error.message, HasSubstr("s.surgery"));
}

TEST_F(ReplayInput, SurgeryWithoutModelIdIsRefused) {
  ASSERT_TRUE(io::SurgeryFile::create(folder / "s.surgery", io::SurgeryMeta{"box"})->close());
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("meta.model_id"));
}

TEST_F(ReplayInput, SurgeryWithoutObservationIsRefused) {
  ASSERT_TRUE(io::SurgeryFile::create(folder / "s.surgery", io::SurgeryMeta{"box", "m"})->close());
  EXPECT_EQ(refused().code, ErrorCode::kEmptySet);
}

TEST_F(ReplayInput, UndecodableObservationIsNamed) {
  auto file = io::SurgeryFile::create(folder / "s.surgery", io::SurgeryMeta{"box", "m"});
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append({io::RecordKind::kObservation, 12, 0, "\xff\xff\xff"}));
  ASSERT_TRUE(file->close());
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("observation 12"));
}

TEST(Summary, PercentilesLeaveOutTheFirstUpdateWhichIsTheColdOne) {
  PlayedSession session;
  for (int i = 1; i <= 5; ++i) {
    PlayedObservation observation;
    observation.sequence = static_cast<std::uint64_t>(i);
    observation.latency_ms = 100.0 * (6 - i);  // 500, 400, ... 100
    observation.first_iterate_ms = 10.0 * i;
    observation.timings.invert_ms = i == 5 ? 1000.0 : i;
    session.observations.push_back(observation);
  }
  RunReport run;
  summarise(session, run);
  EXPECT_EQ(run.updates, 5);
  EXPECT_DOUBLE_EQ(run.latency_ms->p50, 250.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p95, 385.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p99, 397.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->max, 400.0);
  EXPECT_DOUBLE_EQ(*run.cold_ms, 500.0);
  EXPECT_DOUBLE_EQ(*run.first_iterate_ms, 30.0);
  EXPECT_DOUBLE_EQ(run.stages_ms->invert_ms, 3.0);
}

TEST(Summary, ASingleUpdateIsBothTheColdOneAndTheLatency) {
  PlayedSession session;
  session.observations.resize(1);
  session.observations[0].latency_ms = 70.0;
  RunReport run;
  summarise(session, run);
  EXPECT_DOUBLE_EQ(*run.cold_ms, 70.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p50, 70.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->max, 70.0);
}

TEST(Summary, WithoutUpdatesThereAreNeitherTimesNorAQuality) {
  RunReport run;
  summarise(PlayedSession{}, run);
  EXPECT_EQ(run.updates, 0);
  EXPECT_FALSE(run.latency_ms);
  EXPECT_FALSE(run.cold_ms);
  EXPECT_FALSE(run.stages_ms);
  EXPECT_FALSE(run.quality);
}

TEST(Summary, TheWorstVerdictOfARunStands) {
  const Quality order[] = {Quality::kGood, Quality::kCaution, Quality::kNotJudged,
                           Quality::kUnusable};  // ever worse
  PlayedSession session;
  for (const Quality quality : order) {
    PlayedObservation observation;
    observation.latency_ms = 1.0;
    observation.quality.quality = quality;
    session.observations.push_back(observation);
    std::rotate(session.observations.rbegin(), session.observations.rbegin() + 1,
                session.observations.rend());
    RunReport run;
    summarise(session, run);
    ASSERT_TRUE(run.quality);
    EXPECT_EQ(run.quality->worst, to_string(quality));
  }
}

TEST(SummaryLine, CountsVerdictsFlagsAndFailures) {
  RunReport run;
  run.scenario = "paper";
  run.method = "condensed";
  run.boundary = "contact";
  EXPECT_EQ(summary_line(run), "paper, condensed, contact: 0 updates");
  run.updates = 1;
  run.quality = RunQuality{"good", "good", "", {1, 0, 0, 0}, {}};
  EXPECT_EQ(summary_line(run), "paper, condensed, contact: 1 update (1 good)");
  run.updates = 12;
  run.quality = RunQuality{
      "unusable", "caution", "", {7, 2, 1, 2}, {{"deadline", 2}, {"inverted_elements", 1}}};
  run.failures.resize(3);
  run.recovery_pct = 97.66;
  EXPECT_EQ(summary_line(run),
            "paper, condensed, contact: 12 updates (7 good, 2 with caution, 1 unusable, 2 not "
            "judged); deadline 2, inverted_elements 1; 3 failed; 97.7 % recovered at the tumour");
}

TEST(Trace, PairsHistoryWithTheIteratesThatArrived) {
  PlayedSession session;
  session.last = update(1, true, 3).update;
  session.iterates = {{1, Points::Constant(3, 2, 4.0)}, {3, Points::Constant(3, 2, 6.0)}};
  const auto trace = trace_of(session, [](const Points& u) { return MeanStd{u(0, 0), 0.0}; });
  ASSERT_EQ(trace.size(), 3u);
  EXPECT_DOUBLE_EQ(trace[0].cross->mean, 4.0);
  EXPECT_FALSE(trace[1].cross);
  EXPECT_DOUBLE_EQ(trace[2].cross->mean, 6.0);
  EXPECT_DOUBLE_EQ(trace[1].sparse.mean, 0.5);
  EXPECT_EQ(trace[2].penetrating, 7);
  EXPECT_DOUBLE_EQ(trace[1].elapsed_ms, 200.0);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(LatencyCsv, HasOneRowPerObservationSent) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true)}; };
  const auto lines = lines_of(latency_csv(play(daemon.link(), recording(2), repeated(1000))));
  ASSERT_EQ(lines.size(), 2001u);
  EXPECT_THAT(lines[1], testing::StartsWith("1,1,"));
  EXPECT_THAT(lines[2000], testing::StartsWith("2000,2000,"));
  for (const std::string& line : lines) EXPECT_EQ(std::count(line.begin(), line.end(), ','), 9);
}

TEST(LatencyCsv, TellsTimesContactAndOutcome) {
  PlayedSession session;
  session.observations.resize(3);
  PlayedObservation& good = session.observations[0];
  good.sequence = 41;
  good.latency_ms = 1234.5;
  good.timings = {0.25, 20.0, 3.5, 0.125, 99.0};
  good.active = 612;
  good.contact_iterations = 7;
  good.status = EstimateStatus::kDeadline;
  session.observations[1].sequence = 42;
  session.observations[1].error = Error{ErrorCode::kEmptySet, "too few, points"};
  session.observations[2].sequence = 43;
  session.observations[2].superseded = true;
  EXPECT_THAT(lines_of(latency_csv(session)),
              testing::ElementsAre(
                  "update,observation_sequence,latency_ms,register_ms,invert_ms,rebuild_ms,"
                  "encode_ms,active,contact_iterations,status",
                  "1,41,1234.5000,0.2500,20.0000,3.5000,0.1250,612,7,deadline",
                  "2,42,,,,,,,,empty_set", "3,43,,,,,,,,superseded"));
}

}  // namespace
}  // namespace brainshift::client
