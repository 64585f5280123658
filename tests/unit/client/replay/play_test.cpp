// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/replay/play.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <sstream>
#include <thread>

#include "client/replay/replay.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr std::uint64_t kSession = 7;

wire::UpdateMessage update(std::uint64_t observation, bool final, int iteration = 1) {
  wire::UpdateMessage message;
  message.session_id = kSession;
  message.update.observation_sequence = observation;
  message.update.final = final;
  message.update.timings.invert_ms = 10.0 * static_cast<double>(observation);
  message.update.estimate.displacement = Points::Constant(3, 2, static_cast<double>(iteration));
  for (int i = 1; i <= iteration; ++i) {
    message.update.estimate.history.push_back({i, {1.0 / i, 0.1}, 10 - i, 0.5 / i, 100.0 * i});
  }
  return message;
}

// Answers every observation by a scripted list of messages.
struct ScriptedDaemon {
  std::function<std::vector<wire::UpdateMessage>(const Observation&)> script;
  std::function<Result<wire::ObservationReceipt>(const Observation&)> on_submit =
      [](const Observation& o) {
        return wire::ObservationReceipt{o.sequence, false};
      };
  std::deque<wire::UpdateMessage> queue;
  std::vector<std::uint64_t> submitted;
  std::vector<std::chrono::steady_clock::time_point> submitted_at;

  DaemonLink link() {
    return {[this](const Observation& o) -> Result<wire::ObservationReceipt> {
              submitted.push_back(o.sequence);
              submitted_at.push_back(std::chrono::steady_clock::now());
              auto receipt = on_submit(o);
              if (receipt) {
                for (auto& message : script(o)) queue.push_back(std::move(message));
              }
              return receipt;
            },
            [this](milliseconds timeout) -> Result<wire::UpdateMessage> {
              if (queue.empty()) {
                const auto until = std::chrono::steady_clock::now() + timeout;
                while (std::chrono::steady_clock::now() < until) std::this_thread::yield();
                return fail(ErrorCode::kUnavailable, "nothing came");
              }
              auto message = std::move(queue.front());
              queue.pop_front();
              return message;
            }};
  }
};

std::vector<RecordedObservation> recording(int count, std::int64_t spacing_ns = 0) {
  std::vector<RecordedObservation> observations(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    observations[static_cast<std::size_t>(i)].recorded_ns = 5'000'000'000 + i * spacing_ns;
    observations[static_cast<std::size_t>(i)].observation.sequence =
        static_cast<std::uint64_t>(i + 1);
    observations[static_cast<std::size_t>(i)].observation.source = "ius";
  }
  return observations;
}

const PlayOptions kOptions{kSession, Speed::kMax, milliseconds(20)};

TEST(Play, SendsTheNextOnlyAfterTheFinalUpdateOfTheFormer) {
  ScriptedDaemon daemon;
  std::vector<std::size_t> pending_when_sent;
  daemon.script = [&](const Observation& o) {
    pending_when_sent.push_back(daemon.queue.size());
    return std::vector{update(o.sequence, false, 1), update(o.sequence, false, 2),
                       update(o.sequence, true, 3)};
  };
  const PlayedSession played = play(daemon.link(), recording(3), kOptions);
  EXPECT_THAT(daemon.submitted, testing::ElementsAre(1, 2, 3));
  EXPECT_THAT(pending_when_sent, testing::Each(0u));
  ASSERT_EQ(played.observations.size(), 3u);
  for (const PlayedObservation& o : played.observations) {
    ASSERT_TRUE(o.latency_ms);
    ASSERT_TRUE(o.first_iterate_ms);
    EXPECT_LE(*o.first_iterate_ms, *o.latency_ms);
    EXPECT_FALSE(o.error);
  }
  ASSERT_TRUE(played.last);
  EXPECT_EQ(played.last->observation_sequence, 3u);
  ASSERT_EQ(played.iterates.size(), 2u);  // of the last observation only
  EXPECT_EQ(played.iterates[1].iteration, 2);
}

TEST(Play, IgnoresTheSnapshotOfAnEarlierSession) {
  ScriptedDaemon daemon;
  auto stale = update(1, true, 9);
  stale.session_id = kSession - 1;
  daemon.queue.push_back(stale);
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true, 4)}; };
  const PlayedSession played = play(daemon.link(), recording(1), kOptions);
  ASSERT_TRUE(played.last);
  EXPECT_EQ(played.last->estimate.history.size(), 4u);
}

TEST(Play, FailedUpdateIsRecordedAndTheRestGoesOn) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) {
    auto message = update(o.sequence, true);
    if (o.sequence == 1) message.error = Error{ErrorCode::kEmptySet, "too few points"};
    return std::vector{message};
  };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  ASSERT_TRUE(played.observations[0].error);
  EXPECT_EQ(played.observations[0].error->message, "too few points");
  EXPECT_FALSE(played.observations[0].latency_ms);
  EXPECT_TRUE(played.observations[1].latency_ms);

  RunReport run;
  summarise(played, run);
  EXPECT_EQ(run.updates, 1);
  ASSERT_EQ(run.failures.size(), 1u);
  EXPECT_EQ(run.failures[0].code, "empty_set");
}

TEST(Play, IteratesOfAFailedObservationAreNotTakenForTheNextOne) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) {
    std::vector messages = {update(o.sequence, false, 1), update(o.sequence, true, 2)};
    if (o.sequence == 1) messages[1].error = Error{ErrorCode::kNotConverged, "stopped"};
    return messages;
  };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  EXPECT_EQ(played.iterates.size(), 1u);
}

TEST(Play, RefusedObservationIsRecordedAndTheRestGoesOn) {
  ScriptedDaemon daemon;
  daemon.on_submit = [](const Observation& o) -> Result<wire::ObservationReceipt> {
    if (o.sequence == 1) return fail(ErrorCode::kInvalidArgument, "frame lps");
    return wire::ObservationReceipt{o.sequence, false};
  };
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true)}; };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  EXPECT_EQ(played.observations[0].error->code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(played.observations[1].latency_ms);
}

TEST(Play, SilenceBecomesATimeoutOfThatObservation) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) {
    return o.sequence == 1 ? std::vector<wire::UpdateMessage>{}
                           : std::vector{update(o.sequence, true)};
  };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  ASSERT_TRUE(played.observations[0].error);
  EXPECT_EQ(played.observations[0].error->code, ErrorCode::kUnavailable);
  EXPECT_THAT(played.observations[0].error->message, HasSubstr("20 ms"));
  EXPECT_TRUE(played.observations[1].latency_ms);
}

TEST(Play, LostDaemonEndsThePlayAtOnce) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation&) { return std::vector<wire::UpdateMessage>{}; };
  DaemonLink link = daemon.link();
  link.next_update = [](milliseconds) -> Result<wire::UpdateMessage> {
    return fail(ErrorCode::kUnavailable, "daemon is gone");
  };
  PlayOptions options = kOptions;
  options.timeout = std::chrono::hours(1);
  const PlayedSession played = play(link, recording(3), options);
  EXPECT_EQ(daemon.submitted.size(), 1u);
  for (const PlayedObservation& o : played.observations) {
    ASSERT_TRUE(o.error);
    EXPECT_EQ(o.error->message, "daemon is gone");
  }
  EXPECT_FALSE(played.last);
}

TEST(Play, RecordedSpeedKeepsTheRecordedDistances) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true)}; };
  PlayOptions options = kOptions;
  options.speed = Speed::kRecorded;
  play(daemon.link(), recording(3, 30'000'000), options);
  ASSERT_EQ(daemon.submitted_at.size(), 3u);
  EXPECT_GE(daemon.submitted_at[1] - daemon.submitted_at[0], milliseconds(29));
  EXPECT_GE(daemon.submitted_at[2] - daemon.submitted_at[0], milliseconds(59));
}

TEST(Play, ObservationReplacedByANewerOneIsSuperseded) {
  ScriptedDaemon daemon;
  daemon.on_submit = [](const Observation& o) {
    return wire::ObservationReceipt{o.sequence, o.sequence == 2};
  };
  daemon.script = [](const Observation& o) {
    return o.sequence == 1 ? std::vector<wire::UpdateMessage>{}
                           : std::vector{update(o.sequence, true)};
  };
  PlayOptions options = kOptions;
  options.speed = Speed::kRecorded;
  const PlayedSession played = play(daemon.link(), recording(2, 1'000'000), options);
  EXPECT_TRUE(played.observations[0].superseded);
  EXPECT_FALSE(played.observations[0].error);
  EXPECT_TRUE(played.observations[1].latency_ms);
}

PlayOptions repeated(int repeat) {
  PlayOptions options = kOptions;
  options.repeat = repeat;
  return options;
}

TEST(Repeat, CyclesThroughTheRecordingWithSequencesThatKeepCountingUp) {
  ScriptedDaemon daemon;
  std::vector<std::string> sources;
  std::vector<std::size_t> pending_when_sent;
  daemon.script = [&](const Observation& o) {
    sources.push_back(o.source);
    pending_when_sent.push_back(daemon.queue.size());
    auto message = update(o.sequence, true, static_cast<int>(o.sequence));
    message.update.estimate.status = EstimateStatus::kConverged;
    message.update.estimate.contact = {static_cast<int>(10 * o.sequence), 0, 0.0, 3};
    return std::vector{message};
  };
  auto observations = recording(3);
  for (std::size_t i = 0; i < 3; ++i) {
    observations[i].observation.sequence = 5 + 2 * i;  // 5, 7, 9
    observations[i].observation.source = std::string(1, static_cast<char>('a' + i));
  }
  const PlayedSession played = play(daemon.link(), observations, repeated(4));
  EXPECT_THAT(daemon.submitted, testing::ElementsAre(5, 7, 9, 10, 12, 14, 15, 17, 19, 20, 22, 24));
  EXPECT_THAT(sources,
              testing::ElementsAre("a", "b", "c", "a", "b", "c", "a", "b", "c", "a", "b", "c"));
  EXPECT_THAT(pending_when_sent, testing::Each(0u));
  ASSERT_EQ(played.observations.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(played.observations[i].sequence, daemon.submitted[i]);
    EXPECT_TRUE(played.observations[i].latency_ms);
    EXPECT_EQ(played.observations[i].active, static_cast<int>(10 * daemon.submitted[i]));
    EXPECT_EQ(played.observations[i].contact_iterations, 3);
    EXPECT_EQ(played.observations[i].status, EstimateStatus::kConverged);
  }
  ASSERT_TRUE(played.last);
  EXPECT_EQ(played.last->observation_sequence, 24u);
  EXPECT_EQ(played.last_recorded_sequence, 9u);  // whose truth it is scored with
}

TEST(Repeat, TruthIsThatOfTheLastObservationAnswered) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) {
    auto message = update(o.sequence, true);
    if (o.sequence == 6) message.error = Error{ErrorCode::kEmptySet, "too few points"};
    return std::vector{message};
  };
  const PlayedSession played = play(daemon.link(), recording(3), repeated(2));
  ASSERT_TRUE(played.last);
  EXPECT_EQ(played.last->observation_sequence, 5u);
  EXPECT_EQ(played.last_recorded_sequence, 2u);
}

TEST(Repeat, OnceSendsTheRecordedSequences) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true)}; };
  auto observations = recording(2);
  observations[1].observation.sequence = 40;
  play(daemon.link(), observations, repeated(1));
  EXPECT_THAT(daemon.submitted, testing::ElementsAre(1, 40));
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

TEST(Summary, WithoutUpdatesTimesStayEmpty) {
  RunReport run;
  summarise(PlayedSession{}, run);
  EXPECT_EQ(run.updates, 0);
  EXPECT_FALSE(run.latency_ms);
  EXPECT_FALSE(run.cold_ms);
  EXPECT_FALSE(run.stages_ms);
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
  auto file = io::SurgeryFile::create(path, {{"case_id", "box"}, {"model_id", "m"}});
  ASSERT_TRUE(file);
  for (const std::uint64_t sequence : sequences) {
    Observation observation;
    observation.case_id = "box";
    observation.source = "ius";
    observation.sequence = sequence;
    observation.body = LandmarkPairs{Points::Random(3, 4), Points::Random(3, 4), 0.3};
    ASSERT_TRUE(file->append({"observation", sequence, 0, wire::encode(observation)}));
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
  ASSERT_TRUE(io::SurgeryFile::create(folder / "s.surgery", {{"case_id", "box"}})->close());
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("meta.model_id"));
}

TEST_F(ReplayInput, SurgeryWithoutObservationIsRefused) {
  ASSERT_TRUE(io::SurgeryFile::create(folder / "s.surgery", {{"case_id", "box"}, {"model_id", "m"}})
                  ->close());
  EXPECT_EQ(refused().code, ErrorCode::kEmptySet);
}

TEST_F(ReplayInput, UndecodableObservationIsNamed) {
  auto file =
      io::SurgeryFile::create(folder / "s.surgery", {{"case_id", "box"}, {"model_id", "m"}});
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append({"observation", 12, 0, "\xff\xff\xff"}));
  ASSERT_TRUE(file->close());
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("observation 12"));
}

}  // namespace
}  // namespace brainshift::client
