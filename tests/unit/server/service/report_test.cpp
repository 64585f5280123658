// SPDX-License-Identifier: GPL-3.0-or-later
// What the daemon says of itself, against what its clients have seen.
#include <gmock/gmock.h>

#include <future>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>

#include "common/wire/report.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;
using wire::DaemonReport;
using wire::SourceCounts;

class ReportTest : public TransportTest {
 protected:
  static DaemonReport report_of(RawPeer& peer) {
    peer.request(MessageType::kReportRequest);
    return value_or_fail(wire::decode_report(next(peer, MessageType::kReportReply).payload));
  }
  // Asks until it holds, for at most 10 s.
  template <typename Condition>
  static DaemonReport report_when(RawPeer& peer, const Condition& holds) {
    DaemonReport report;
    EXPECT_TRUE(eventually([&] { return holds(report = report_of(peer)); }));
    return report;
  }
  static std::uint64_t sum(const SourceCounts& counts) {
    return counts.answered + counts.failed + counts.replaced + counts.skipped + counts.refused +
           counts.repeated + counts.waiting;
  }
  static bool nothing_waits(const DaemonReport& report) {
    for (const SourceCounts& counts : report.sources) {
      if (counts.waiting > 0) return false;
    }
    return report.working_ms == 0.0;
  }
};

TEST_F(ReportTest, ADaemonWithoutAModelReportsToo) {
  serve(without_model());
  RawPeer peer(endpoint_);
  peer.hand_in(landmarks(1));
  const DaemonReport report = report_of(peer);
  EXPECT_EQ(report.version, "1.2.3");
  EXPECT_FALSE(report.model_ready);
  EXPECT_EQ(report.session.phase, SessionPhase::kEmpty);
  EXPECT_FALSE(report.journal.has_value());
  EXPECT_EQ(report.clients, 1u);
  EXPECT_GT(report.process.resident_bytes, 0u);
  EXPECT_GT(report.process.threads, 1u);
  ASSERT_EQ(report.sources.size(), 1u);
  EXPECT_EQ(report.sources[0].refused, 1u);
  EXPECT_EQ(error_of(peer.ask(MessageType::kReportRequest, "rubbish")).code, ErrorCode::kProtocol);
}

TEST_F(ReportTest, NamesSessionOwnerViewersAndTheirCredit) {
  serve(with_model());
  RawPeer owner(endpoint_);
  RawPeer viewer(endpoint_);
  start_session(owner);
  subscribe(viewer, 1);
  // The first goes out on the viewer's credit; the second has to wait for it.
  owner.hand_in(landmarks(1));
  report_when(owner, [](const DaemonReport& told) { return told.usable == 1; });
  owner.hand_in(landmarks(2));
  const DaemonReport report = report_when(owner, [](const DaemonReport& told) {
    return told.usable == 2 && nothing_waits(told) && told.viewers.at(0).owed == 1;
  });
  EXPECT_EQ(report.session.session, (SessionKey{kBootId, 1, kModelId}));
  EXPECT_EQ(report.session.phase, SessionPhase::kTracking);
  EXPECT_EQ(report.case_id, kCase);
  EXPECT_EQ(report.owner.size(), 10u) << "five bytes of a routing id";
  EXPECT_GT(report.max_age_s, 0.0);
  EXPECT_EQ(report.clients, 2u);
  ASSERT_EQ(report.viewers.size(), 1u);
  EXPECT_NE(report.viewers[0].peer, report.owner);
  EXPECT_EQ(report.viewers[0].window, 1u);
  EXPECT_EQ(report.viewers[0].sent, 1u);
  EXPECT_EQ(report.viewers[0].received, 0u);
}

TEST_F(ReportTest, TellsWhatTheDoorTurnedAway) {
  RouterOptions options;
  options.limits.session_starts_per_min = 1;
  options.limits.observations_per_s = 2;
  serve(with_model(), options);
  RawPeer peer(endpoint_);
  start_session(peer);
  for (int i = 0; i < 2; ++i) {
    peer.start(SessionRequest{kCase});
  }
  for (std::uint64_t sequence = 1; sequence <= 20; ++sequence) peer.hand_in(landmarks(sequence));
  const wire::DoorFigures door = report_of(peer).door;
  EXPECT_EQ(door.accepted, 1u);
  EXPECT_EQ(door.refused_starts, 2u);
  EXPECT_GT(door.refused_observations, 0u);
  EXPECT_EQ(door.closed_for_breach + door.closed_for_memory + door.closed_for_silence, 0u);
}

// The stages are parts of the way: their sum is no more than the whole.
TEST_F(ReportTest, EveryUpdateIsTimedStageByStage) {
  serve(with_model());
  RawPeer peer(endpoint_);
  begin_with_update(peer, 1);
  for (std::uint64_t sequence = 2; sequence <= 20; ++sequence) {
    ASSERT_EQ(answer(peer, landmarks(sequence)).update.observation_sequence, sequence);
  }
  const DaemonReport report =
      report_when(peer, [](const DaemonReport& told) { return told.usable == 20; });
  double parts_ms = 0.0;
  for (const wire::StageLatency& stage : report.stages) {
    EXPECT_EQ(stage.all.count, 20u) << stage.stage;
    EXPECT_EQ(stage.recent.count, 20u) << stage.stage;
    std::uint64_t counted = 0;
    for (const std::uint64_t bucket : stage.bucket_counts) counted += bucket;
    EXPECT_EQ(counted, 20u) << stage.stage;
    EXPECT_LE(stage.recent.p50_ms, stage.recent.p99_ms);
    EXPECT_LE(stage.recent.p99_ms, stage.recent.max_ms);
    // Queueing for the journal lies in front of the worker's wait for the update.
    if (stage.stage != "total" && stage.stage != "journal") parts_ms += stage.sum_ms;
  }
  EXPECT_GT(parts_ms, 0.0);
  EXPECT_EQ(report.stages.back().stage, "total");
  EXPECT_LE(parts_ms, report.stages.back().sum_ms);
}

TEST_F(ReportTest, JournalIsNamedWithWhatItHoldsAndWhyItDoesNotRecord) {
  const test_support::TemporaryFolder folder;
  serve(with_journal(folder.path(), open_surgery_file));
  RawPeer peer(endpoint_);
  begin_with_update(peer, 1);
  // An observation, its decision, its update.
  const DaemonReport report =
      report_when(peer, [](const DaemonReport& told) { return told.journal->records == 3; });
  EXPECT_TRUE(report.journal->recording);
  EXPECT_THAT(report.journal->file, HasSubstr(folder.path().string()));
  EXPECT_GT(report.journal->bytes, 4096u);
  EXPECT_EQ(report.journal->lost, 0u);
}

TEST_F(ReportTest, WhatTheJournalLosesIsCounted) {
  const test_support::TemporaryFolder folder;
  serve(with_journal(folder.path(), disk_full));
  RawPeer peer(endpoint_);
  begin_with_update(peer, 1);
  const DaemonReport report =
      report_when(peer, [](const DaemonReport& told) { return told.journal->lost == 2; });
  EXPECT_FALSE(report.journal->recording);
  EXPECT_EQ(report.journal->reason, "j.surgery: disk full");
}

// A worker that is busy for longer than its session's updates may take hangs; a preparation may
// take as long as it takes.
TEST_F(ReportTest, WhatTheWorkerIsAtIsSeenWhileItIsAtIt) {
  std::promise<void> entered, leave, preparing, prepared;
  ServiceOptions options = with_inverter([&](int, const SparseData& data, const auto&, auto& out) {
    entered.set_value();
    leave.get_future().wait();
    return follow_the_data(data, out, 4);
  });
  const auto make = options.make_model;
  options.make_model = [&, make](const SessionRequest& request, const std::stop_token& stop) {
    preparing.set_value();
    prepared.get_future().wait();
    return make(request, stop);
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  RawPeer watcher(endpoint_);
  peer.request(MessageType::kStartSessionRequest, wire::encode(session_of()));
  preparing.get_future().wait();
  EXPECT_EQ(report_of(watcher).working_ms, 0.0);
  prepared.set_value();
  ASSERT_EQ(peer.receive().type, MessageType::kStartSessionReply);
  peer.hand_in(landmarks(1));
  entered.get_future().wait();
  const DaemonReport busy = report_of(watcher);
  EXPECT_GT(busy.working_ms, 0.0);
  EXPECT_EQ(busy.limit_ms, 1e3 * (kNoDeadline_s + ServiceManager::kGrace.count()));
  EXPECT_FALSE(busy.worker_hangs());
  leave.set_value();
  const DaemonReport idle = report_when(watcher, nothing_waits);
  EXPECT_EQ(idle.limit_ms, 1e3 * ServiceManager::kGrace.count());
}

TEST_F(ReportTest, AWorkerThatIsBusyForLongerThanItMayHangsUntilItIsDone) {
  std::promise<void> entered, leave;
  ServiceOptions options = with_inverter([&](int, const SparseData& data, const auto&, auto& out) {
    entered.set_value();
    leave.get_future().wait();
    return follow_the_data(data, out, 4);
  });
  const auto make = options.make_model;
  options.make_model = [make](const SessionRequest& request, const std::stop_token& stop) {
    auto model = make(request, stop);
    // With the time that is allowed beside it: none at all.
    (*model)->deadline_s = -static_cast<double>(ServiceManager::kGrace.count());
    return model;
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  start_session(peer);
  EXPECT_FALSE(report_of(peer).worker_hangs());
  peer.hand_in(landmarks(1));
  entered.get_future().wait();
  EXPECT_TRUE(report_of(peer).worker_hangs());
  leave.set_value();
  EXPECT_FALSE(report_when(peer, nothing_waits).worker_hangs());
}

// What clients have sent and been told, against the counts, whatever happens to their observations.
class RandomRun : public ReportTest {
 protected:
  struct Seen {
    std::uint64_t sent = 0;
    std::uint64_t refused = 0;
    std::uint64_t replaced = 0;
  };

  // A third of the inversions fail, a third of the rest is unusable.
  static FakeInverter::Update moody() {
    return [](int call, const SparseData& data, const auto&, Estimate& out) -> Status {
      if (call % 3 == 0) return fail(ErrorCode::kNotConverged, "no luck");
      return follow_the_data(data, out, 4);
    };
  }

  void restart(RawPeer& peer) {
    start_session(peer);
    ++session_;
    for (auto& [source, sequence] : sequences_) sequence = 0;
  }

  void send_something(RawPeer& peer) {
    const std::string source = kSources[pick(std::size(kSources))];
    std::uint64_t& last = sequences_[source];
    const std::size_t kind = pick(10);
    const double shift_mm = pick(3) == 0 ? 60.0 : 1.0;  // beyond what a skull allows
    Observation observation = in_session(session_, landmarks(last + 1, source, shift_mm));
    if (kind == 0) observation.case_id = "someone-else";
    if (kind == 1) observation.sequence = 0;
    if (kind == 2) observation.sequence = last;  // the last one once more, or one too few
    if (kind == 3) {
      std::get<LandmarkPairs>(observation.body).deformed(0, 0) =
          std::numeric_limits<double>::quiet_NaN();
    }
    const Received reply = peer.hand_in(observation);
    // One that cannot be read has no source; a source that nothing was accepted of has no row.
    const bool accepted = reply.type == MessageType::kObservationReply;
    if (accepted) known_.insert(source);
    Seen& seen = seen_[kind == 3 || known_.count(source) == 0 ? "" : source];
    ++seen.sent;
    if (!accepted) {
      ++seen.refused;
      return;
    }
    const auto receipt = wire::decode_observation_receipt(reply.payload);
    if (kind != 2 && receipt->replaced_pending) ++seen.replaced;
    if (kind > 3) ++last;
  }

  std::size_t pick(std::size_t count) { return random_() % count; }

  static constexpr const char* kSources[] = {"ius", "pointer", "stereopsis"};
  std::mt19937_64 random_{11};
  std::uint64_t session_ = 0;
  std::map<std::string, std::uint64_t> sequences_;
  std::set<std::string> known_;
  std::map<std::string, Seen> seen_;
};

TEST_F(RandomRun, EveryObservationIsCountedOnceWithWhatBecameOfIt) {
  serve(with_inverter(moody()));
  RawPeer peer(endpoint_);
  restart(peer);
  for (int i = 0; i < 2000; ++i) {
    if (pick(200) == 0) restart(peer);
    send_something(peer);
    if (i % 50 != 0) continue;
    for (const SourceCounts& counts : report_of(peer).sources) {
      ASSERT_EQ(counts.received, sum(counts)) << counts.source << " after " << i;
    }
  }
  const DaemonReport report = report_when(peer, nothing_waits);
  std::uint64_t answered = 0, failed = 0, replaced = 0, skipped = 0, repeated = 0;
  ASSERT_EQ(report.sources.size(), seen_.size());
  for (const SourceCounts& counts : report.sources) {
    const Seen& seen = seen_[counts.source];
    EXPECT_EQ(counts.received, seen.sent) << counts.source;
    EXPECT_EQ(counts.refused, seen.refused) << counts.source;
    EXPECT_EQ(counts.replaced, seen.replaced) << counts.source;
    EXPECT_EQ(counts.received, sum(counts)) << counts.source;
    answered += counts.answered;
    failed += counts.failed;
    replaced += counts.replaced;
    skipped += counts.skipped;
    repeated += counts.repeated;
  }
  EXPECT_EQ(answered, report.usable + report.unusable);
  EXPECT_EQ(failed, report.failures);
  EXPECT_EQ(report.stages.back().all.count, answered);
  for (const std::uint64_t count : {report.usable, report.unusable, failed, repeated}) {
    EXPECT_GT(count, 0u) << "the run has to hold every kind";
  }
  static_cast<void>(skipped);
}

// Deterministic: one is under way while two more of its source come, and then the session ends.
TEST_F(RandomRun, ReplacedAndSkippedAreCounted) {
  std::promise<void> entered;
  serve(
      with_inverter([&](int call, const SparseData& data, const auto& asked, auto& out) -> Status {
        if (call > 1) return follow_the_data(data, out, 4);
        entered.set_value();
        return wait_for_stop(asked.stop);
      }));
  RawPeer peer(endpoint_);
  start_session(peer);
  peer.hand_in(landmarks(1));
  entered.get_future().wait();
  for (const std::uint64_t sequence : {2u, 3u}) peer.hand_in(landmarks(sequence));
  EXPECT_EQ(report_of(peer).sources.at(0).waiting, 2u) << "one at work, one in its box";
  start_session(peer);
  const SourceCounts counts = report_when(peer, nothing_waits).sources.at(0);
  EXPECT_EQ(counts.received, 3u);
  EXPECT_EQ(counts.replaced, 1u);
  EXPECT_EQ(counts.skipped, 2u);
}

}  // namespace
}  // namespace brainshift::server
