// SPDX-License-Identifier: GPL-3.0-or-later
// Who receives which update, and when.
#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/wire/convert.hpp"
#include "server/operations/latency_record.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

TEST_F(TransportTest, AnAnswerThatTookTwiceAsLongAsUsualIsMarkedLate) {
  std::atomic<double> at_least_ms = 0.0;
  serve(with_inverter([&](int, const SparseData& data, const auto&, auto& out) {
    const Stopwatch watch;
    while (watch.milliseconds() < at_least_ms) std::this_thread::yield();
    return follow_the_data(data, out, 4);
  }));
  RawPeer peer(endpoint_);
  begin(peer);
  const auto time_of = [&](const Observation& observation) {
    return answer(peer, observation).update.answer_time;
  };
  double longest_ms = 0.0;
  for (std::uint64_t sequence = 1; sequence <= UsualTime::kFew; ++sequence) {
    const AnswerTime time = time_of(landmarks(sequence));
    EXPECT_GT(time.ms, 0.0);
    EXPECT_EQ(time.usual_ms, 0.0);
    EXPECT_FALSE(time.late()) << "nothing is usual yet";
    longest_ms = std::max(longest_ms, time.ms);
  }
  at_least_ms = 2.1 * longest_ms;
  const AnswerTime late = time_of(landmarks(UsualTime::kFew + 1));
  EXPECT_GT(late.ms, 2.1 * longest_ms);
  EXPECT_GT(late.usual_ms, 0.0);
  EXPECT_LE(late.usual_ms, 1.01 * longest_ms);
  EXPECT_TRUE(late.late());
  // Another session begins with nothing usual, whatever the one before took.
  start_session(peer);
  EXPECT_EQ(time_of(in_session(2, landmarks(1))).usual_ms, 0.0);
}

TEST_F(TransportTest, TwoClientsReceiveEveryUpdate) {
  serve(with_model());
  RawPeer sender(endpoint_);
  RawPeer watcher(endpoint_);
  begin(sender);
  subscribe(watcher);
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) {
    sender.observe(landmarks(sequence, "pointer", static_cast<double>(sequence)));
    for (RawPeer* peer : {&sender, &watcher}) {
      const auto message = next_update(*peer);
      EXPECT_EQ(message.update.observation_sequence, sequence);
      EXPECT_FALSE(message.error.has_value());
      EXPECT_EQ(message.update.estimate.displacement(0, 0), static_cast<double>(sequence));
    }
  }
}

TEST_F(TransportTest, ALateSubscriberReceivesTheLastUpdateAtOnce) {
  serve(with_model());
  RawPeer sender(endpoint_);
  begin_with_update(sender, 42);
  RawPeer late(endpoint_);
  subscribe(late);
  EXPECT_EQ(next_update(late).update.observation_sequence, 42u);
}

// The first field that it sees is one of the running session.
TEST_F(TransportTest, ALateSubscriberReceivesNothingOfASessionThatHasEnded) {
  serve(with_model());
  RawPeer sender(endpoint_);
  begin_with_update(sender, 42);
  start_session(sender);
  RawPeer late(endpoint_);
  subscribe(late);
  sender.observe(in_session(2, landmarks(1)));
  for (RawPeer* peer : {&late, &sender}) {
    const auto message = next_update(*peer);
    EXPECT_EQ(message.session_id, 2u);
    EXPECT_EQ(message.update.observation_sequence, 1u);
  }
  // Now there is one to keep.
  RawPeer later(endpoint_);
  subscribe(later);
  EXPECT_EQ(next_update(later).session_id, 2u);
}

TEST_F(TransportTest, AFailedObservationIsToldAndTheLastUpdateStays) {
  serve(with_a_failure());
  RawPeer peer(endpoint_);
  begin(peer);
  EXPECT_FALSE(answer(peer, landmarks(1)).error.has_value());
  const auto failed = answer(peer, landmarks(2));
  ASSERT_TRUE(failed.error.has_value());
  EXPECT_EQ(failed.error->code, ErrorCode::kNotConverged);
  EXPECT_EQ(failed.update.observation_sequence, 2u);
  RawPeer late(endpoint_);
  subscribe(late);
  EXPECT_EQ(next_update(late).update.observation_sequence, 1u);
}

// A throwing library costs one session or one observation, not the daemon.
TEST_F(TransportTest, AnExceptionCostsOneStartOrOneObservation) {
  ServiceOptions options = with_model();
  auto starts = std::make_shared<int>(0);
  options.make_model = [starts](const SessionRequest& request, const auto&) {
    if (++*starts == 1) throw std::runtime_error("thrown");
    return fake_session(std::make_unique<FakeInverter>(
                            [](int call, const SparseData& data, const auto&, Estimate& out) {
                              if (call == 1) throw std::runtime_error("thrown");
                              return follow_the_data(data, out, 4);
                            }),
                        request);
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  const Error refused = error_of(peer.start(SessionRequest{kCase}));
  EXPECT_EQ(refused.code, ErrorCode::kInternal);
  begin(peer);
  const auto failed = answer(peer, landmarks(1));
  ASSERT_TRUE(failed.error.has_value());
  EXPECT_EQ(failed.error->code, ErrorCode::kInternal);
  EXPECT_FALSE(answer(peer, landmarks(2)).error.has_value());
}

TEST_F(TransportTest, IteratesAreStreamedOnlyWhenAskedForAndCarryTheirUpdatesNumber) {
  serve(with_inverter([](int, const SparseData& data, const auto& asked, auto& out) {
    Estimate iterate;
    (void)follow_the_data(data, iterate, 4);
    iterate.status = EstimateStatus::kIterating;
    if (asked.on_iterate) asked.on_iterate(iterate);
    return follow_the_data(data, out, 4);
  }));
  RawPeer peer(endpoint_);
  begin_with_update(peer, 1);
  SessionRequest iterating = session_of();
  iterating.publish_iterates = true;
  peer.request(MessageType::kStartSessionRequest, wire::encode(iterating));
  next(peer, MessageType::kStartSessionReply);
  const auto iterate = answer(peer, in_session(2, landmarks(1)));
  EXPECT_FALSE(iterate.update.final);
  const auto last = next_update(peer);
  EXPECT_TRUE(last.update.final);
  EXPECT_EQ(iterate.update.sequence, last.update.sequence);
  EXPECT_EQ(iterate.key(), last.key());
  EXPECT_EQ(iterate.session_id, 2u);
}

TEST_F(TransportTest, AnUnusableUpdateIsToldToAllAndReplacesNoUsableOne) {
  serve(with_model());
  RawPeer sender(endpoint_);
  RawPeer watcher(endpoint_);
  begin(sender);
  subscribe(watcher);
  sender.observe(landmarks(1));
  for (RawPeer* peer : {&sender, &watcher}) EXPECT_TRUE(next_update(*peer).update.usable());
  for (std::uint64_t sequence = 2; sequence <= 7; ++sequence) {
    sender.observe(landmarks(sequence, "pointer", kMaxMotion_mm + 1.0));
    for (RawPeer* peer : {&sender, &watcher}) {
      const auto message = next_update(*peer);
      EXPECT_EQ(message.update.observation_sequence, sequence);
      EXPECT_FALSE(message.error.has_value());
      EXPECT_EQ(message.update.estimate.status, EstimateStatus::kConverged);
      EXPECT_EQ(message.update.estimate.quality.quality, Quality::kUnusable);
      EXPECT_TRUE(message.update.estimate.quality.flags.has(QualityFlag::kBeyondSkull));
      EXPECT_THAT(message.update.estimate.quality.reason, HasSubstr("motion 51 mm"));
    }
  }
  // One who comes late sees the usable field, and what has come of it since.
  RawPeer late(endpoint_);
  subscribe(late);
  const auto snapshot = next_update(late);
  EXPECT_EQ(snapshot.update.observation_sequence, 1u);
  EXPECT_TRUE(snapshot.update.usable());
  EXPECT_EQ(next_update(late).update.observation_sequence, 7u);
  sender.observe(landmarks(8));
  EXPECT_EQ(next_update(late).update.observation_sequence, 8u);
  RawPeer later(endpoint_);
  subscribe(later);
  EXPECT_EQ(next_update(later).update.observation_sequence, 8u);
  later.request(MessageType::kStatusRequest);
  Received received = later.receive();
  while (received.type == MessageType::kSessionState) received = later.receive();
  EXPECT_EQ(received.type, MessageType::kStatusReply)
      << "the failures before the snapshot are over";
}

// It reads one update, the one that was under way, and then the newest; nothing between.
TEST_F(TransportTest, AViewerThatDoesNotReadDelaysNobodyAndGetsTheNewestUpdate) {
  constexpr std::uint64_t kUpdates = 60;
  serve(with_model(40'000));  // 0.5 MB per update
  RawPeer sender(endpoint_);
  RawPeer slow(endpoint_);
  begin(sender);
  subscribe(slow, 1);
  for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
    ASSERT_EQ(answer(sender, landmarks(sequence)).update.observation_sequence, sequence);
  }
  EXPECT_EQ(next_update(slow).update.observation_sequence, 1u);
  slow.request(MessageType::kSubscribeRequest, wire::encode(Subscription{1, 1, 1}));
  EXPECT_EQ(next_update(slow).update.observation_sequence, kUpdates);
}

TEST_F(TransportTest, TheStateSaysWhatIsNewestAndHowOldItIs) {
  serve(with_a_failure());
  RawPeer peer(endpoint_);
  EXPECT_EQ(renew(peer, {1, 8, 0}).phase, SessionPhase::kEmpty);
  begin_with_update(peer, 5);
  const SessionState tracking = renew(peer, {1, 8, 1});
  EXPECT_EQ(tracking.phase, SessionPhase::kTracking);
  EXPECT_EQ(tracking.newest_update, 1u);
  EXPECT_EQ(tracking.newest_usable, 1u);
  EXPECT_GT(tracking.age_ms, 0.0);
  peer.observe(landmarks(6));
  ASSERT_TRUE(next_update(peer).error.has_value());
  const SessionState degraded = renew(peer, {1, 8, 2});
  EXPECT_EQ(degraded.phase, SessionPhase::kDegraded);
  EXPECT_EQ(degraded.reason, "no luck");
  EXPECT_EQ(degraded.newest_update, 2u);
  EXPECT_EQ(degraded.newest_usable, 1u);
  EXPECT_GT(degraded.age_ms, tracking.age_ms);
}

TEST_F(TransportTest, EverySubscriberIsToldWhenTheSessionOrItsPhaseChanges) {
  serve(with_model());
  RawPeer owner(endpoint_);
  RawPeer watcher(endpoint_);
  subscribe(watcher);
  const auto next_phase = [&] {
    const Received received = next(watcher, MessageType::kSessionState);
    EXPECT_EQ(received.request_id, 0u);
    return wire::decode_session_state(received.payload)->phase;
  };
  // The same may be told more than once.
  const auto next_but = [&](SessionPhase known) {
    SessionPhase phase = next_phase();
    while (phase == known) phase = next_phase();
    return phase;
  };
  start_session(owner);
  EXPECT_EQ(next_phase(), SessionPhase::kPreparing);
  EXPECT_EQ(next_but(SessionPhase::kPreparing), SessionPhase::kReady);
  owner.observe(landmarks(1));
  EXPECT_EQ(next_but(SessionPhase::kReady), SessionPhase::kTracking);
}

TEST_F(TransportTest, ASessionOfAnotherClientEndsOnlyByTakeoverOrWhenThatClientHasLeft) {
  serve(with_model());
  auto owner = std::make_unique<RawPeer>(endpoint_);
  RawPeer other(endpoint_);
  start_session(*owner);
  SessionRequest request = session_of();
  const auto ask = [&] { return other.start(request); };
  const Error refused = error_of(ask());
  EXPECT_EQ(refused.code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.message, HasSubstr("belongs to another client"));
  request.takeover = true;
  EXPECT_EQ(ask().type, MessageType::kStartSessionReply);
  request.takeover = false;
  EXPECT_EQ(ask().type, MessageType::kStartSessionReply) << "its own";
  const auto mine = owner->start(request);
  EXPECT_EQ(error_of(mine).code, ErrorCode::kUnavailable);
  request.takeover = true;
  ASSERT_EQ(owner->start(request).type, MessageType::kStartSessionReply);
  owner.reset();
  request.takeover = false;
  EXPECT_TRUE(eventually([&] { return ask().type == MessageType::kStartSessionReply; }));
}

// Keeps what would be written.
struct KeptRecords {
  std::mutex mutex;
  std::vector<io::SurgeryRecord> records;  // observations and updates
  std::vector<io::SurgeryRecord> decisions;
};
class KeepingSink final : public RecordSink {
 public:
  explicit KeepingSink(std::shared_ptr<KeptRecords> kept) : kept_(std::move(kept)) {}
  Status append(std::span<const io::SurgeryRecord> records) override {
    const std::lock_guard lock(kept_->mutex);
    for (const io::SurgeryRecord& record : records) {
      const bool decision = record.kind == io::RecordKind::kDecision;
      (decision ? kept_->decisions : kept_->records).push_back(record);
    }
    return {};
  }
  Status close() override { return {}; }

 private:
  std::shared_ptr<KeptRecords> kept_;
};

TEST_F(TransportTest, TheJournalHoldsTheBytesThatClientsReceive) {
  const test_support::TemporaryFolder folder;
  const auto kept = std::make_shared<KeptRecords>();
  serve(with_journal(folder.path(),
                     [kept](const auto&, const auto&) -> Result<std::unique_ptr<RecordSink>> {
                       return std::make_unique<KeepingSink>(kept);
                     }));
  RawPeer peer(endpoint_);
  begin(peer);
  std::vector<std::string> published;
  for (std::uint64_t sequence = 1; sequence <= 3; ++sequence) {
    const std::string observation = wire::encode(landmarks(sequence));
    peer.request(MessageType::kObservation, observation);
    const Received received = next(peer, MessageType::kUpdate);
    published.push_back(observation);
    published.push_back(received.payload);
    const auto message = value_or_fail(wire::decode_update(received.payload));
    // The bytes carry the times of their own encoding and of their observation's journalling.
    EXPECT_GT(message.update.timings.encode_ms, 0.0);
    EXPECT_GT(message.update.timings.journal_ms, 0.0);
  }
  stop();  // writes the journal out
  ASSERT_EQ(kept->records.size(), published.size());
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_EQ(kept->records[i].kind,
              i % 2 == 0 ? io::RecordKind::kObservation : io::RecordKind::kUpdate);
    std::string expected = published[i];
    if (i % 2 == 0) {  // an observation, to which the daemon adds its own time
      const auto observation = value_or_fail(wire::decode_observation(kept->records[i].payload));
      EXPECT_GT(observation.daemon_ns, 0);
      wire::append_daemon_time(observation.daemon_ns, expected);
    }
    EXPECT_TRUE(kept->records[i].payload == expected) << "record " << i;
  }
  ASSERT_EQ(kept->decisions.size(), 3u);
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto decision = value_or_fail(wire::decode_decision(kept->decisions[i].payload));
    EXPECT_EQ(decision.outcome, Outcome::kUsed);
    EXPECT_EQ(decision.observation_sequence, i + 1);
    EXPECT_EQ(decision.update_sequence, i + 1);
  }
}

TEST_F(TransportTest, AFailureOfTheJournalReachesTheClients) {
  const test_support::TemporaryFolder folder;
  serve(with_journal(folder.path(), disk_full));
  RawPeer peer(endpoint_);
  begin(peer);
  // The journal fails on its own thread: the first updates may come before it has.
  std::string told;
  for (std::uint64_t sequence = 1; told.empty() && sequence <= 1000; ++sequence) {
    peer.observe(landmarks(sequence));
    for (const Omission& omission : next_update(peer).update.left_out) {
      if (omission.part == "journal") told = omission.reason;
    }
  }
  EXPECT_EQ(told, "j.surgery: disk full");
}

// Accepted is one thing, recorded another: the state says which observations are on the disk.
TEST_F(TransportTest, TheStateSaysWhatIsRecordedAndWhyNothingIs) {
  const test_support::TemporaryFolder folder;
  serve(with_journal(folder.path(), open_surgery_file));
  RawPeer peer(endpoint_);
  begin_with_update(peer, 3);
  const auto recorded = [&] {
    const auto state = renew(peer, {1, 8, 1}).recording;
    return state && state->recording && state->holds("pointer", 3);
  };
  while (!recorded()) {  // the disk takes its time; a state that never says so ends the program
  }
  EXPECT_FALSE(renew(peer, {1, 8, 1}).recording->holds("pointer", 4));
}

TEST_F(TransportTest, EverySubscriberIsToldWhenTheDaemonDoesNotRecord) {
  const test_support::TemporaryFolder folder;
  serve(with_journal(folder.path(), disk_full));
  RawPeer watcher(endpoint_);
  subscribe(watcher);
  RawPeer owner(endpoint_);
  start_session(owner);
  std::string reason;
  while (reason.find("disk full") == std::string::npos) {
    const auto state =
        wire::decode_session_state(next(watcher, MessageType::kSessionState).payload);
    if (!state->recording->recording) reason = state->recording->reason;
  }
}

TEST_F(TransportTest, StopsWhenAskedWhileAnInversionRuns) {
  std::promise<void> entered;
  serve(with_inverter([&](int, const SparseData&, const auto& asked, auto&) -> Status {
    entered.set_value();
    return wait_for_stop(asked.stop);
  }));
  RawPeer peer(endpoint_);
  start_session(peer);
  peer.observe(landmarks(1));
  entered.get_future().wait();
  expect_alive();  // the transport answers while the worker is busy
  stop();
}

}  // namespace
}  // namespace brainshift::server
