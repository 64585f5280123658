// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/replay/play.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <thread>

#include "client/replay/replay.hpp"
#include "common/io/surgery_file.hpp"
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

TEST(Summary, PercentilesAndMediansOverFinalUpdates) {
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
  EXPECT_DOUBLE_EQ(run.latency_ms->p50, 300.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p95, 480.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p99, 496.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->max, 500.0);
  EXPECT_DOUBLE_EQ(*run.cold_ms, 500.0);
  EXPECT_DOUBLE_EQ(*run.first_iterate_ms, 30.0);
  EXPECT_DOUBLE_EQ(run.stages_ms->invert_ms, 3.0);
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
  Error refused() const {
    ReplayOptions options;
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
