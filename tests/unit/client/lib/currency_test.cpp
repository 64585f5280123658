// SPDX-License-Identifier: Apache-2.0
// What a viewer gets to see after it has not read, and after the daemon has been replaced.
#include <gmock/gmock.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/lib/fake_daemon.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using wire::encode;
using wire::encode_frame;
using wire::Frame;
using wire::MessageType;

Client viewer_of(const std::string& endpoint) {
  return connect_to(endpoint, {.request_timeout = kPatience,
                               .session_timeout = kPatience,
                               .renewal_interval = milliseconds(20)});
}

std::string current_frame(const SessionKey& key, std::uint64_t sequence) {
  UpdateMessage message = small_update(sequence, Quality::kGood);
  message.session_id = key.session_id;
  message.boot_id = key.boot_id;
  message.update.model_id = key.model_id;
  return encode_frame(MessageType::kUpdate, 0, encode(message));
}

// Grants credit as the daemon does, one update at a time; a status request makes a new update.
class Simulated {
 public:
  explicit Simulated(SessionKey key) : key_(std::move(key)) {}

  Answers operator()(const Frame& request) {
    const std::lock_guard lock(mutex_);
    const std::uint64_t id = request.request_id;
    switch (request.type) {
      case MessageType::kSubscribeRequest: {
        const auto wanted = wire::decode_subscription(request.payload).value();
        subscriptions_.push_back(wanted);
        if (wanted.id != subscription_) sent_ = told_ = 0;
        subscription_ = wanted.id;
        Answers answers = {encode_frame(MessageType::kSessionState, id, wire::encode(state()))};
        push(wanted.received, answers);
        return answers;
      }
      case MessageType::kStatusRequest: {
        ++newest_;
        Answers answers;
        push(sent_, answers, /*credit=*/subscription_ != 0 && sent_ == acknowledged_);
        answers.push_back(encode_frame(MessageType::kStatusReply, id, encode(DaemonStatus{})));
        return answers;
      }
      default: return {};
    }
  }

  std::vector<Subscription> subscriptions() {
    const std::lock_guard lock(mutex_);
    return subscriptions_;
  }

 private:
  SessionState state() const {
    SessionState state;
    state.session = key_;
    state.phase = newest_ > 0 ? SessionPhase::kTracking : SessionPhase::kReady;
    state.newest_update = state.newest_usable = newest_;
    state.valid_ms = 1000;
    return state;
  }
  void push(std::uint64_t received, Answers& answers, bool credit = true) {
    acknowledged_ = received;
    if (!credit || sent_ != received || newest_ == told_) return;
    answers.push_back(current_frame(key_, newest_));
    told_ = newest_;
    ++sent_;
  }

  SessionKey key_;
  std::mutex mutex_;
  std::vector<Subscription> subscriptions_;
  std::uint64_t subscription_ = 0, sent_ = 0, acknowledged_ = 0, told_ = 0, newest_ = 0;
};

const SessionKey kKey{11, 1, "model"};

TEST(Currency, AViewerThatHasNotReadGetsTheNewestUpdateFirst) {
  auto daemon = std::make_shared<Simulated>(kKey);
  FakeDaemon server([daemon](const Frame& request) { return (*daemon)(request); });
  Client viewer = viewer_of(server.endpoint());
  ASSERT_TRUE(viewer.subscribe());
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(viewer.status());  // 30 updates, none read
  const auto first = value_or_fail(viewer.next_update(kPatience));
  EXPECT_EQ(first.update.sequence, 30u);
  EXPECT_EQ(viewer.field_status().currency, Currency::kCurrent);
  EXPECT_FALSE(viewer.next_update(milliseconds(100))) << "nothing is newer";
}

TEST(Currency, RenewsWhileItWaitsAndSoStaysCurrent) {
  auto daemon = std::make_shared<Simulated>(kKey);
  FakeDaemon server([daemon](const Frame& request) { return (*daemon)(request); });
  Client viewer = viewer_of(server.endpoint());
  ASSERT_TRUE(viewer.subscribe());
  ASSERT_TRUE(viewer.status());
  ASSERT_TRUE(viewer.next_update(kPatience));
  EXPECT_FALSE(viewer.next_update(milliseconds(300)));
  EXPECT_GT(daemon->subscriptions().size(), 3u);
  EXPECT_EQ(daemon->subscriptions().back().received, 1u);
  EXPECT_EQ(viewer.field_status().currency, Currency::kCurrent);
  server.stop();
  EXPECT_THAT(viewer.next_update(kPatience).error().message, HasSubstr("lost the connection"));
  EXPECT_FALSE(viewer.next_update(milliseconds(1200)));  // longer than an answer holds
  const FieldStatus status = viewer.field_status();
  EXPECT_EQ(status.currency, Currency::kStale);
  EXPECT_THAT(status.reason, HasSubstr("no word from " + server.endpoint()));
}

// The daemon is restarted, and the viewer makes a request that is answered before it reads on.
TEST(Currency, SubscribesAgainAfterARestartThatAnotherCallNoticed) {
  const test_support::TemporaryFolder folder;
  const std::string endpoint = "ipc://" + (folder / "daemon").string();
  auto first = std::make_shared<Simulated>(kKey);
  auto server = std::make_unique<FakeDaemon>(
      [first](const Frame& request) { return (*first)(request); }, endpoint);
  Client viewer = viewer_of(endpoint);
  ASSERT_TRUE(viewer.subscribe());
  ASSERT_TRUE(viewer.status());
  ASSERT_TRUE(viewer.next_update(kPatience));
  ASSERT_TRUE(viewer.latest_usable());
  server.reset();
  auto second = std::make_shared<Simulated>(SessionKey{12, 1, "model"});
  server = std::make_unique<FakeDaemon>(
      [second](const Frame& request) { return (*second)(request); }, endpoint);
  auto status = viewer.status();
  if (!status) status = viewer.status();
  ASSERT_TRUE(status) << status.error().message;
  auto update = viewer.next_update(kPatience);
  if (!update) update = viewer.next_update(kPatience);
  ASSERT_TRUE(update) << update.error().message;
  EXPECT_EQ(update->boot_id, 12u);
  EXPECT_EQ(viewer.latest_usable()->boot_id, 12u);
  EXPECT_EQ(viewer.field_status().currency, Currency::kCurrent);
}

TEST(Currency, AnotherPatientsModelIsShownByNoViewerAndEachSaysWhy) {
  const test_support::TemporaryFolder folder;
  const std::string endpoint = "ipc://" + (folder / "daemon").string();
  auto first = std::make_shared<Simulated>(kKey);
  const auto with_model = [](const std::shared_ptr<Simulated>& daemon) {
    return [daemon](const Frame& request) -> Answers {
      if (request.type != MessageType::kModelRequest) return (*daemon)(request);
      BrainModel model;
      model.model_id = "model";
      model.mesh.nodes = Points::Random(3, 2);
      return {encode_frame(MessageType::kModelReply, request.request_id, wire::encode(model))};
    };
  };
  auto server = std::make_unique<FakeDaemon>(with_model(first), endpoint);
  Client viewer = viewer_of(endpoint);
  ASSERT_TRUE(viewer.model());
  ASSERT_TRUE(viewer.subscribe());
  ASSERT_TRUE(viewer.status());
  ASSERT_TRUE(viewer.next_update(kPatience));
  server.reset();
  auto second = std::make_shared<Simulated>(SessionKey{12, 1, "another"});
  server = std::make_unique<FakeDaemon>(with_model(second), endpoint);
  for (int i = 0; i < 3 && !viewer.status(); ++i) {
  }
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(viewer.next_update(milliseconds(100)));
  EXPECT_FALSE(viewer.latest_usable());
  const FieldStatus status = viewer.field_status();
  EXPECT_EQ(status.currency, Currency::kNone);
  EXPECT_THAT(status.reason, HasSubstr("serves model another, this viewer has loaded model"));
}

TEST(Currency, AnObservationIsForTheSessionThatItsSourceKnows) {
  auto daemon = std::make_shared<Simulated>(kKey);
  std::mutex mutex;
  SessionKey last;
  const auto named = [&] {
    const std::lock_guard lock(mutex);
    return last;
  };
  FakeDaemon server([&](const Frame& request) -> Answers {
    if (request.type != MessageType::kObservation) return (*daemon)(request);
    const auto observation = wire::decode_observation(request.payload).value();
    {
      const std::lock_guard lock(mutex);
      last = observation.session;
    }
    return {encode_frame(MessageType::kObservationReply, request.request_id,
                         encode(ObservationReceipt{observation.sequence, false}))};
  });
  Client source = viewer_of(server.endpoint());
  Observation observation;
  observation.sequence = 1;
  observation.body = TumourBoundary{Points::Random(3, 4), 0.5};
  ASSERT_TRUE(source.subscribe());
  ASSERT_TRUE(source.submit(observation));
  EXPECT_EQ(named(), kKey);
  observation.session = {1, 2, "other"};
  ASSERT_TRUE(source.submit(observation));
  EXPECT_EQ(named(), observation.session) << "what the caller names is left as it is";
}

TEST(Currency, AWindowOutsideItsRangeIsRefused) {
  Client viewer = viewer_of("tcp://127.0.0.1:1");
  for (const std::uint32_t window : {0u, Subscription::kMaxWindow + 1}) {
    EXPECT_THAT(sentence_of(viewer.subscribe(window)), HasSubstr("must be in [1, 256]"));
  }
}

}  // namespace
}  // namespace brainshift::client
