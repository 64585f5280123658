// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "client/tools/replay/play.hpp"
#include "client/tools/replay/replay.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

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

TEST(Play, AnUnusableUpdateIsCountedAndTheUsableOneBeforeItIsScored) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) {
    return std::vector{update(o.sequence, false, static_cast<int>(o.sequence)),
                       o.sequence == 2 ? update(2, true, 5) : unusable_update(o.sequence)};
  };
  const PlayedSession played = play(daemon.link(), recording(4), kOptions);
  for (const PlayedObservation& o : played.observations) EXPECT_TRUE(o.latency_ms);
  ASSERT_TRUE(played.last);
  EXPECT_EQ(played.last->observation_sequence, 2u);
  EXPECT_EQ(played.last_recorded_sequence, 2u);
  ASSERT_EQ(played.iterates.size(), 1u);
  EXPECT_EQ(played.iterates[0].iteration, 2);

  RunReport run;
  summarise(played, run);
  EXPECT_EQ(run.updates, 4);
  EXPECT_TRUE(run.failures.empty());
  ASSERT_TRUE(run.quality);
  EXPECT_EQ(run.quality->worst, "unusable");
  EXPECT_EQ(run.quality->last, "unusable");
  EXPECT_EQ(run.quality->reason, "elements are turned inside out (9)");
  EXPECT_EQ(run.quality->counts.good, 1);
  EXPECT_EQ(run.quality->counts.unusable, 3);
  EXPECT_EQ(run.quality->flags, (std::map<std::string, int>{{"inverted_elements", 3}}));
}

TEST(Play, WithoutAnyUsableUpdateThereIsNothingToScore) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) { return std::vector{unusable_update(o.sequence)}; };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  EXPECT_FALSE(played.last);
  RunReport run;
  summarise(played, run);
  EXPECT_EQ(run.updates, 2);
  EXPECT_EQ(run.status, "not_run");
  EXPECT_EQ(run.quality->worst, "unusable");
}

TEST(Play, RefusedObservationIsRecordedAndTheRestGoesOn) {
  ScriptedDaemon daemon;
  daemon.on_submit = [](const Observation& o) -> Result<ObservationReceipt> {
    if (o.sequence == 1) return invalid("frame lps");
    return ObservationReceipt{o.sequence, false};
  };
  daemon.script = [](const Observation& o) { return std::vector{update(o.sequence, true)}; };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  EXPECT_EQ(played.observations[0].error->code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(played.observations[1].latency_ms);
}

TEST(Play, SilenceBecomesATimeoutOfThatObservation) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation& o) {
    return o.sequence == 1 ? std::vector<UpdateMessage>{} : std::vector{update(o.sequence, true)};
  };
  const PlayedSession played = play(daemon.link(), recording(2), kOptions);
  ASSERT_TRUE(played.observations[0].error);
  EXPECT_EQ(played.observations[0].error->code, ErrorCode::kUnavailable);
  EXPECT_THAT(played.observations[0].error->message, HasSubstr("20 ms"));
  EXPECT_TRUE(played.observations[1].latency_ms);
}

TEST(Play, LostDaemonEndsThePlayAtOnce) {
  ScriptedDaemon daemon;
  daemon.script = [](const Observation&) { return std::vector<UpdateMessage>{}; };
  DaemonLink link = daemon.link();
  link.next_update = [](milliseconds) -> Result<UpdateMessage> {
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
    return ObservationReceipt{o.sequence, o.sequence == 2};
  };
  daemon.script = [](const Observation& o) {
    return o.sequence == 1 ? std::vector<UpdateMessage>{} : std::vector{update(o.sequence, true)};
  };
  PlayOptions options = kOptions;
  options.speed = Speed::kRecorded;
  const PlayedSession played = play(daemon.link(), recording(2, 1'000'000), options);
  EXPECT_TRUE(played.observations[0].superseded);
  EXPECT_FALSE(played.observations[0].error);
  EXPECT_TRUE(played.observations[1].latency_ms);
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

TEST(ForReplay, IsForAnySessionAndByTheClockOfTheDaemonThatJournalledIt) {
  Observation recorded;
  recorded.acquired_ns = 5;
  recorded.sent_ns = 6;
  recorded.session = {1, 2, "m"};
  EXPECT_EQ(for_replay(recorded).acquired_ns, 5);
  recorded.daemon_ns = 700;
  const Observation sent = for_replay(recorded);
  EXPECT_EQ(sent.acquired_ns, 700);
  EXPECT_EQ(sent.sent_ns, 0);
  EXPECT_EQ(sent.daemon_ns, 0);
  EXPECT_EQ(sent.session, SessionKey{});
}

namespace fs = std::filesystem;
using testing::ElementsAre;

Observation observed(const std::string& source, std::uint64_t sequence) {
  Observation observation;
  observation.case_id = "box";
  observation.source = source;
  observation.sequence = sequence;
  observation.body = LandmarkPairs{Points::Ones(3, 4), Points::Ones(3, 4), 0.3};
  return observation;
}

io::SurgeryRecord resumed_record(const std::string& source, std::uint64_t sequence) {
  return {io::RecordKind::kObservation, sequence, 0, wire::encode(observed(source, sequence))};
}

class Resume : public testing::Test {
 protected:
  const test_support::TemporaryFolder folder;
  const fs::path path = folder / "crashed.surgery";
};

TEST_F(Resume, AJournalThatWasNotClosedSaysWhatEachSourceRecordedLast) {
  auto file = value_or_fail(io::SurgeryFile::create(path, {.model_id = "m"}));
  ASSERT_TRUE(file.append(resumed_record("ius", 4)));
  ASSERT_TRUE(file.append(resumed_record("camera", 50)));
  ASSERT_TRUE(file.append(resumed_record("ius", 6)));
  ASSERT_TRUE(file.append({io::RecordKind::kUpdate, 3, 0, "opaque"}));
  const auto point = value_or_fail(read_resume_point(path));
  EXPECT_EQ(point.meta.model_id, "m");
  EXPECT_EQ(point.records, 4u);
  EXPECT_FALSE(point.broken);
  EXPECT_EQ(describe(point), "goes on after observation 50 of camera and 6 of ius, update 3");
}

TEST_F(Resume, ABrokenJournalCountsUpToTheBreak) {
  {
    auto file = value_or_fail(io::SurgeryFile::create(path, {}));
    std::vector<io::SurgeryRecord> records;
    for (std::uint64_t i = 1; i <= 200; ++i) records.push_back(resumed_record("ius", i));
    ASSERT_TRUE(file.append(records));
    ASSERT_TRUE(file.close());
  }
  fs::resize_file(path, fs::file_size(path) * 9 / 10);
  const auto point = value_or_fail(read_resume_point(path));
  ASSERT_TRUE(point.broken);
  EXPECT_THAT(point.broken->message, HasSubstr("record "));
  EXPECT_EQ(point.last.at("ius").sequence, point.records);
  EXPECT_LT(point.records, 200u);
  EXPECT_GT(point.records, 50u);
}

TEST_F(Resume, TheLastRecordedObservationOfEverySourceIsSentAgain) {
  std::vector<RecordedObservation> recording;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    recording.push_back({0, observed("ius", i)});
    recording.push_back({0, observed("camera", 10 + i)});
    recording.push_back({0, observed("pointer", i)});
  }
  ResumePoint point;
  point.last = {{"ius", observed("ius", 4)},
                {"camera", observed("camera", 13)},
                {"stranger", observed("stranger", 9)}};
  std::vector<std::string> left;
  for (const auto& one : value_or_fail(remaining(recording, point))) {
    left.push_back(one.observation.source + std::to_string(one.observation.sequence));
  }
  EXPECT_THAT(left, ElementsAre("pointer1", "pointer2", "camera13", "pointer3", "ius4", "camera14",
                                "pointer4"));
  EXPECT_EQ(remaining(recording, {})->size(), recording.size());
  EXPECT_EQ(describe(ResumePoint{}), "begins anew: no observation is recorded");
}

TEST_F(Resume, AJournalOfAnotherSurgeryIsRefused) {
  const std::vector<RecordedObservation> recording = {{0, observed("ius", 1)}};
  Observation other = observed("ius", 1);
  std::get<LandmarkPairs>(other.body).deformed(0, 0) += 1e-9;
  ResumePoint point;
  for (const Observation& last : {other, observed("ius", 2)}) {
    point.last = {{"ius", last}};
    EXPECT_THAT(remaining(recording, point).error().message,
                HasSubstr("observation " + std::to_string(last.sequence) + " of \"ius\""));
  }
}

TEST(Play, EndsWhenItsSessionDoes) {
  ScriptedDaemon daemon;
  DaemonLink link = daemon.link();
  link.session_status = [&]() -> Status {
    if (daemon.submitted.size() < 2) return {};
    return fail(ErrorCode::kUnavailable, "session 3 has ended");
  };
  daemon.script = [](const Observation& o) {
    if (o.sequence == 1) return std::vector{update(o.sequence, true)};
    return std::vector<UpdateMessage>{};
  };
  const PlayedSession played = play(link, recording(3), kOptions);
  EXPECT_EQ(daemon.submitted.size(), 2u);
  EXPECT_TRUE(played.observations[0].latency_ms);
  for (const int i : {1, 2})
    EXPECT_EQ(played.observations[i].error->message, "session 3 has ended");
  ASSERT_TRUE(played.lost);
}

}  // namespace
}  // namespace brainshift::client
