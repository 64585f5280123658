// SPDX-License-Identifier: GPL-3.0-or-later
// Who receives which update, and when.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

TEST_F(TransportTest, TwoClientsReceiveEveryUpdate) {
  serve(with_model());
  RawPeer sender(endpoint_);
  RawPeer watcher(endpoint_);
  start_session(sender);
  subscribe(sender);
  subscribe(watcher);
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) {
    sender.request(MessageType::kObservation,
                   wire::encode(landmarks(sequence, "pointer", static_cast<double>(sequence))));
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
  sender.request(MessageType::kObservation, wire::encode(landmarks(1)));
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
  ServiceOptions options = with_model();
  options.make_model = [](const wire::SessionRequest& request) {
    return fake_session(
        std::make_unique<FakeInverter>(
            [](int call, const SparseData& data, const auto&, Estimate& estimate) -> Status {
              if (call == 2) return fail(ErrorCode::kNotConverged, "no luck");
              return follow_the_data(data, estimate, 4);
            }),
        request);
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  start_session(peer);
  subscribe(peer);
  peer.request(MessageType::kObservation, wire::encode(landmarks(1)));
  EXPECT_FALSE(next_update(peer).error.has_value());
  peer.request(MessageType::kObservation, wire::encode(landmarks(2)));
  const auto failed = next_update(peer);
  ASSERT_TRUE(failed.error.has_value());
  EXPECT_EQ(failed.error->code, ErrorCode::kNotConverged);
  EXPECT_EQ(failed.update.observation_sequence, 2u);
  RawPeer late(endpoint_);
  subscribe(late);
  EXPECT_EQ(next_update(late).update.observation_sequence, 1u);
}

TEST_F(TransportTest, AnUnusableUpdateIsToldToAllAndReplacesNoUsableOne) {
  serve(with_model());
  RawPeer sender(endpoint_);
  RawPeer watcher(endpoint_);
  start_session(sender);
  subscribe(sender);
  subscribe(watcher);
  sender.request(MessageType::kObservation, wire::encode(landmarks(1)));
  for (RawPeer* peer : {&sender, &watcher}) EXPECT_TRUE(next_update(*peer).update.usable());
  for (std::uint64_t sequence = 2; sequence <= 7; ++sequence) {
    sender.request(MessageType::kObservation,
                   wire::encode(landmarks(sequence, "pointer", kMostMotion_mm + 1.0)));
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
  sender.request(MessageType::kObservation, wire::encode(landmarks(8)));
  EXPECT_EQ(next_update(late).update.observation_sequence, 8u);
  RawPeer later(endpoint_);
  subscribe(later);
  EXPECT_EQ(next_update(later).update.observation_sequence, 8u);
  EXPECT_EQ(later.ask(MessageType::kStatusRequest).type, MessageType::kStatusReply)
      << "the failures before the snapshot are over";
}

TEST_F(TransportTest, ASubscriberThatDoesNotReadDelaysNobodyAndIsOwedTheNewestUpdate) {
  constexpr int kNodes = 40'000;  // 0.5 MB per update
  constexpr std::uint64_t kUpdates = 60;
  RouterOptions options;
  options.send_queue = 2;
  serve(with_model(kNodes), options);
  RawPeer sender(endpoint_);
  RawPeer slow(endpoint_, 1);
  start_session(sender);
  subscribe(sender);
  subscribe(slow);
  for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
    sender.request(MessageType::kObservation, wire::encode(landmarks(sequence)));
    ASSERT_EQ(next_update(sender).update.observation_sequence, sequence);
  }
  std::uint64_t received = 0;
  std::uint64_t last = 0;
  while (last < kUpdates) {
    const std::uint64_t sequence = next_update(slow).update.observation_sequence;
    EXPECT_GT(sequence, last);
    last = sequence;
    ++received;
  }
  EXPECT_LT(received, kUpdates)
      << "nothing was lost: the queues never filled, the test shows nothing";
}

TEST_F(TransportTest, ClientsBeyondTheLimitAreRefusedUntilOneLeaves) {
  RouterOptions options;
  options.max_clients = 2;
  serve(with_model(), options);
  RawPeer first(endpoint_);
  auto second = std::make_unique<RawPeer>(endpoint_);
  subscribe(first);
  subscribe(*second);
  RawPeer third(endpoint_);
  const Error refused = error_of(third.ask(MessageType::kStatusRequest));
  EXPECT_EQ(refused.code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.message, HasSubstr("2 clients"));
  second.reset();
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  MessageType answered = MessageType::kErrorReply;
  while (answered == MessageType::kErrorReply && std::chrono::steady_clock::now() < deadline) {
    answered = third.ask(MessageType::kStatusRequest).type;
  }
  EXPECT_EQ(answered, MessageType::kStatusReply);
}

// Keeps what would be written.
struct KeptRecords {
  std::mutex mutex;
  std::vector<io::SurgeryRecord> records;
};
class KeepingSink final : public RecordSink {
 public:
  explicit KeepingSink(std::shared_ptr<KeptRecords> kept) : kept_(std::move(kept)) {}
  Status append(const io::SurgeryRecord& record) override {
    const std::lock_guard lock(kept_->mutex);
    kept_->records.push_back(record);
    return {};
  }
  Status close() override { return {}; }

 private:
  std::shared_ptr<KeptRecords> kept_;
};

TEST_F(TransportTest, TheJournalHoldsTheBytesThatClientsReceive) {
  ServiceOptions options = with_model();
  const test_support::TemporaryFolder folder;
  const auto kept = std::make_shared<KeptRecords>();
  options.journal_dir = folder.path();
  options.open_journal = [kept](const auto&, const auto&) -> Result<std::unique_ptr<RecordSink>> {
    return std::make_unique<KeepingSink>(kept);
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  start_session(peer);
  subscribe(peer);
  std::vector<std::string> published;
  for (std::uint64_t sequence = 1; sequence <= 3; ++sequence) {
    const std::string observation = wire::encode(landmarks(sequence));
    peer.request(MessageType::kObservation, observation);
    Received received = peer.receive();
    while (received.type != MessageType::kUpdate) received = peer.receive();
    published.push_back(observation);
    published.push_back(received.payload);
    const auto message = wire::decode_update(received.payload);
    ASSERT_TRUE(message.has_value()) << message.error().message;
    // The bytes carry the times of their own encoding and of their observation's journalling.
    EXPECT_GT(message->update.timings.encode_ms, 0.0);
    EXPECT_GT(message->update.timings.journal_ms, 0.0);
  }
  stop();  // writes the journal out
  ASSERT_EQ(kept->records.size(), published.size());
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_EQ(kept->records[i].kind,
              i % 2 == 0 ? io::RecordKind::kObservation : io::RecordKind::kUpdate);
    EXPECT_TRUE(kept->records[i].payload == published[i]) << "record " << i;
  }
}

TEST_F(TransportTest, AFailureOfTheJournalReachesTheClients) {
  ServiceOptions options = with_model();
  const test_support::TemporaryFolder folder;
  options.journal_dir = folder.path();
  options.open_journal = [](const auto&, const auto&) -> Result<std::unique_ptr<RecordSink>> {
    return fail(ErrorCode::kWriteFailed, "j.surgery: disk full");
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  start_session(peer);
  subscribe(peer);
  // The journal fails on its own thread: the first updates may come before it has.
  std::string told;
  for (std::uint64_t sequence = 1; told.empty() && sequence <= 1000; ++sequence) {
    peer.request(MessageType::kObservation, wire::encode(landmarks(sequence)));
    for (const Omission& omission : next_update(peer).update.left_out) {
      if (omission.part == "journal") told = omission.reason;
    }
  }
  EXPECT_EQ(told, "j.surgery: disk full");
}

TEST_F(TransportTest, StopsWhenAskedWhileAnInversionRuns) {
  ServiceOptions options = with_model();
  auto entered = std::make_shared<std::promise<void>>();
  options.make_model = [entered](const wire::SessionRequest& request) {
    return fake_session(std::make_unique<FakeInverter>([entered](int, const SparseData&,
                                                                 const auto& asked, Estimate&) {
                          std::promise<void> stopped;
                          const std::stop_callback wake(asked.stop, [&] { stopped.set_value(); });
                          entered->set_value();
                          stopped.get_future().wait();
                          return Status(fail(ErrorCode::kNotConverged, "stopped"));
                        }),
                        request);
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  start_session(peer);
  peer.request(MessageType::kObservation, wire::encode(landmarks(1)));
  entered->get_future().wait();
  expect_alive();  // the transport answers while the worker is busy
  stop();
}

}  // namespace
}  // namespace brainshift::server
