// SPDX-License-Identifier: Apache-2.0
// A viewer with a choice: what it asks for, what it hands out, and what it does about changes that
// it cannot apply.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <vector>

#include "client/lib/client.hpp"
#include "common/wire/frame.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/lib/fake_daemon.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using wire::encode;
using wire::encode_frame;
using wire::Frame;
using wire::MessageType;

const FieldChoice kChoice{.region = BallRegion{Vec3(1, 2, 3), 4.0}, .tolerance_mm = 0.5};

// Nodes 2 and 5 of ten, both at `value`; or node 5 alone as a change of `base`.
std::string part_frame(std::uint64_t sequence, double value, std::uint64_t base = 0) {
  UpdateMessage message;
  message.session_id = 1;
  message.boot_id = 7;
  message.update.model_id = "model";
  message.update.sequence = sequence;
  message.update.estimate.quality.quality = Quality::kGood;
  std::vector<NodeIndex> nodes = {5};
  if (base == 0) nodes = {2, 5};
  message.update.estimate.displacement =
      Points::Constant(3, static_cast<Eigen::Index>(nodes.size()), value);
  message.update.part = FieldPart{10, std::move(nodes), base};
  return encode_frame(MessageType::kUpdate, 0, encode(message));
}

// Answers the n-th subscription number (from 0) and the first renewal that acknowledges its first
// update with the frames that the script gives.
class Scripted {
 public:
  using Script = std::function<Answers(std::size_t subscription, std::uint64_t received)>;
  explicit Scripted(Script script) : script_(std::move(script)) {}

  Answers operator()(const Frame& request) {
    if (request.type != MessageType::kSubscribeRequest) return {};
    const std::lock_guard lock(mutex_);
    const auto wanted = wire::decode_subscription(request.payload).value();
    const bool anew = asked_.empty() || asked_.back().id != wanted.id;
    if (anew) ++subscriptions_;
    const bool news = anew || wanted.received > asked_.back().received;
    asked_.push_back(wanted);
    SessionState state;
    state.session = {7, 1, "model"};
    state.phase = SessionPhase::kTracking;
    state.newest_update = state.newest_usable = 1;
    state.valid_ms = SessionState::kMaxValidity_ms;
    Answers answers = {
        encode_frame(MessageType::kSessionState, request.request_id, wire::encode(state))};
    if (news) {
      for (std::string& frame : script_(subscriptions_ - 1, wanted.received)) {
        answers.push_back(std::move(frame));
      }
    }
    return answers;
  }
  std::vector<Subscription> asked() {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  Script script_;
  std::mutex mutex_;
  std::vector<Subscription> asked_;
  std::size_t subscriptions_ = 0;
};

struct Viewing {
  explicit Viewing(Scripted::Script script, std::uint32_t window = 8)
      : scripted(std::move(script)),
        daemon([this](const Frame& request) { return scripted(request); }),
        client(Client::connect(daemon.endpoint(),
                               {.request_timeout = kPatience, .renewal_interval = milliseconds(20)})
                   .value()) {
    const Status subscribed = client.subscribe(window, kChoice);
    EXPECT_TRUE(subscribed) << subscribed.error().message;
  }

  Scripted scripted;
  FakeDaemon daemon;
  Client client;
};

Eigen::RowVectorXd x_of(const Result<UpdateMessage>& message) {
  return value_or_fail(message).update.estimate.displacement.row(0);
}

TEST(ClientDelivery, ChangesComeOutAsTheWholeChoiceAndSayWhatTravelled) {
  Viewing viewing([](std::size_t, std::uint64_t received) -> Answers {
    if (received == 0) return {part_frame(1, 1.0), part_frame(2, 2.0, 1)};
    return {};
  });
  EXPECT_EQ(x_of(viewing.client.next_update(kPatience)), Eigen::RowVector2d(1, 1));
  const auto second = viewing.client.next_update(kPatience);
  EXPECT_EQ(x_of(second), Eigen::RowVector2d(1, 2));
  EXPECT_EQ(second->update.part, (FieldPart{10, {2, 5}, 0}));
  EXPECT_EQ(second->received_nodes, 1);
  EXPECT_GT(second->received_bytes, 20u);
  EXPECT_EQ(viewing.scripted.asked().front().choice, kChoice);
}

// Update 2 never came, so update 3 cannot be applied. Nothing of it is shown: the viewer asks anew
// and goes on from the whole choice.
TEST(ClientDelivery, ALostBaseIsAskedForAnewByItself) {
  Viewing viewing([](std::size_t subscription, std::uint64_t received) -> Answers {
    if (received != 0) return {};
    if (subscription == 0) return {part_frame(1, 1.0), part_frame(3, 3.0, 2)};
    return {part_frame(3, 3.0), part_frame(4, 4.0, 3)};
  });
  EXPECT_EQ(x_of(viewing.client.next_update(kPatience)), Eigen::RowVector2d(1, 1));
  EXPECT_EQ(x_of(viewing.client.next_update(kPatience)), Eigen::RowVector2d(3, 3));
  EXPECT_EQ(x_of(viewing.client.next_update(kPatience)), Eigen::RowVector2d(3, 4));
  EXPECT_GT(viewing.scripted.asked().back().id, viewing.scripted.asked().front().id);
}

TEST(ClientDelivery, AMalformedUpdateIsReportedAndAskedForAnew) {
  Viewing viewing([](std::size_t subscription, std::uint64_t received) -> Answers {
    if (received != 0) return {};
    if (subscription == 1) return {part_frame(2, 2.0)};
    return {part_frame(1, 1.0), encode_frame(MessageType::kUpdate, 0, "\xff"),
            part_frame(3, 3.0, 2)};
  });
  EXPECT_EQ(x_of(viewing.client.next_update(kPatience)), Eigen::RowVector2d(1, 1));
  refusal_of(viewing.client.next_update(kPatience), ErrorCode::kProtocol);
  EXPECT_EQ(x_of(viewing.client.next_update(kPatience)), Eigen::RowVector2d(2, 2));
}

// The daemon was restarted with another patient's model, of which no node lies in the region.
TEST(ClientDelivery, AChoiceThatIsRefusedLaterIsReported) {
  std::atomic<int> asked = 0;
  FakeDaemon daemon([&](const Frame& request) -> Answers {
    if (asked++ == 0) {
      SessionState state;
      state.phase = SessionPhase::kEmpty;
      return {encode_frame(MessageType::kSessionState, request.request_id, wire::encode(state))};
    }
    const Error refused{ErrorCode::kEmptySet, "choice: no node lies in the ball"};
    return {encode_frame(MessageType::kErrorReply, request.request_id, wire::encode(refused))};
  });
  auto client =
      value_or_fail(Client::connect(daemon.endpoint(), {.renewal_interval = milliseconds(20)}));
  ASSERT_TRUE(client.subscribe(1, kChoice));
  EXPECT_EQ(refusal_of(client.next_update(kPatience), ErrorCode::kEmptySet),
            "choice: no node lies in the ball");
}

TEST(ClientDelivery, ABadChoiceIsRefusedBeforeItIsSent) {
  auto client = value_or_fail(Client::connect("tcp://127.0.0.1:1"));
  EXPECT_EQ(sentence_of(client.subscribe(1, {.tolerance_mm = -1.0})),
            "choice.tolerance_mm = -1: must be in [0, 100]");
}

}  // namespace
}  // namespace brainshift::client
