// SPDX-License-Identifier: GPL-3.0-or-later
// Viewers with choices of their own, at a daemon over the real socket.
#include <gmock/gmock.h>

#include "client/lib/client.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using client::Client;
using testing::HasSubstr;
constexpr std::chrono::milliseconds kPatient(20000);

// The four nodes of the small model lie at 0 and at 1 mm along x, y and z. Node i moves by 1 + i/10
// of the datum.
MakeSessionModel each_node_its_own() {
  return [](const SessionRequest& request, const std::stop_token&) {
    return fake_session(std::make_unique<FakeInverter>([](int, const SparseData& data, const auto&,
                                                          Estimate& estimate) -> Status {
                          const Status status = follow_the_data(data, estimate, 4);
                          for (int node = 0; node < 4; ++node) {
                            estimate.displacement.col(node) *= 1.0 + 0.1 * node;
                          }
                          return status;
                        }),
                        request);
  };
}

class DeliveryTest : public TransportTest {
 protected:
  void begin() {
    ServiceOptions options = with_model(4);
    options.make_model = each_node_its_own();
    serve(std::move(options));
    sender_.emplace(connected());
    start();
    ASSERT_TRUE(sender_->subscribe());
  }
  void start() {
    const auto started =
        value_or_fail(sender_->start_session({kCase, Method::kPaper, Boundary::kContact}));
    session_ = started.session_id;
  }
  Client connected() { return std::move(*Client::connect(endpoint_)); }
  Client viewer(const FieldChoice& choice, std::uint32_t window = 1) {
    Client client = connected();
    const Status status = client.subscribe(window, choice);
    EXPECT_TRUE(status) << status.error().message;
    return client;
  }
  // The whole field of an observation that moves its data by so much along x.
  UpdateMessage observe(double shift_mm) {
    const auto taken =
        sender_->submit(in_session(session_, landmarks(++sequence_, "pointer", shift_mm)));
    EXPECT_TRUE(taken) << taken.error().message;
    auto update = value_or_fail(sender_->next_update(kPatient));
    EXPECT_EQ(update.update.observation_sequence, sequence_);
    return update;
  }

  std::optional<Client> sender_;
  std::uint64_t session_ = 0, sequence_ = 0;
};

TEST_F(DeliveryTest, EveryViewerGetsWhatItChoseAndTheOthersEverything) {
  begin();
  Client near = viewer({.region = BallRegion{Vec3(0, 1, 0), 1.1}});
  Client bare = viewer({.spacing_mm = 1.1, .with_sd = false});
  const auto whole = observe(2.0);
  EXPECT_EQ(whole.update.part, std::nullopt);
  EXPECT_EQ(whole.update.estimate.displacement.row(0), Eigen::RowVector4d(2, 2.2f, 2.4f, 2.6f));
  const auto part = value_or_fail(near.next_update(kPatient));
  EXPECT_EQ(part.update.part, (FieldPart{4, {0, 2}, 0}));
  EXPECT_EQ(part.update.estimate.displacement.row(0), Eigen::RowVector2d(2, 2.4f));
  EXPECT_EQ(near.latest_usable()->update.part, part.update.part);
  const auto thinned = value_or_fail(bare.next_update(kPatient));
  EXPECT_EQ(thinned.update.part, (FieldPart{4, {0}, 0})) << "all others are 1 mm from node 0";
}

TEST_F(DeliveryTest, ChangesBeyondATolerance) {
  begin();
  Client tolerant = viewer({.tolerance_mm = 0.25});
  observe(1.0);
  EXPECT_EQ(tolerant.next_update(kPatient)->received_nodes, 4) << "first everything";
  // Node i is now 0.2 (1 + i/10) mm from what is held: nodes 0 to 2 stay.
  observe(1.2);
  const auto second = value_or_fail(tolerant.next_update(kPatient));
  EXPECT_EQ(second.received_nodes, 1);
  EXPECT_EQ(second.update.part, std::nullopt);
  EXPECT_EQ(second.update.estimate.displacement.row(0), Eigen::RowVector4d(1, 1.1f, 1.2f, 1.56f));
}

TEST_F(DeliveryTest, ANewSessionBeginsWithEverything) {
  begin();
  Client tolerant = viewer({.tolerance_mm = 50.0});
  observe(1.0);
  EXPECT_EQ(tolerant.next_update(kPatient)->received_nodes, 4);
  start();
  observe(1.5);
  const auto first = value_or_fail(tolerant.next_update(kPatient));
  EXPECT_EQ(first.session_id, session_);
  EXPECT_EQ(first.received_nodes, 4);
  EXPECT_EQ(first.update.estimate.displacement(0, 0), 1.5);
}

TEST_F(DeliveryTest, AnotherChoiceGetsTheLastUpdateAtOnce) {
  begin();
  observe(1.0);
  Client changing = viewer({.region = BallRegion{Vec3(0, 1, 0), 0.5}, .tolerance_mm = 0.1});
  EXPECT_EQ(changing.next_update(kPatient)->update.part, (FieldPart{4, {2}, 0}));
  ASSERT_TRUE(changing.subscribe(1, {.region = BallRegion{Vec3(1, 0, 0), 0.5}}));
  EXPECT_EQ(changing.next_update(kPatient)->update.part, (FieldPart{4, {1}, 0}));
}

TEST_F(DeliveryTest, ARegionWithoutNodesIsRefusedAndTheChoiceBeforeItGoesOn) {
  begin();
  Client choosy = viewer({.region = BallRegion{Vec3(0, 1, 0), 0.5}});
  EXPECT_EQ(refusal_of(choosy.subscribe(1, {.region = BallRegion{Vec3(500, 0, 0), 1.0}}),
                       ErrorCode::kEmptySet),
            "choice: no node lies in the ball of 1 mm about (500, 0, 0) mm");
  observe(1.0);
  const auto update = value_or_fail(choosy.next_update(kPatient));
  EXPECT_EQ(update.update.part, (FieldPart{4, {2}, 0}));
}

TEST_F(DeliveryTest, ViewersWithChoicesThatDoNotReadDelayNobodyAndGetTheNewest) {
  begin();
  std::vector<Client> stopped;
  for (int i = 0; i < 20; ++i) {  // more choices than a turn cuts
    stopped.push_back(viewer({.tolerance_mm = 0.01 * (i + 1)}));
  }
  Client reading = viewer({.tolerance_mm = 0.5});
  for (int update = 1; update <= 30; ++update) {
    const auto whole = observe(update);
    const auto seen = value_or_fail(reading.next_update(kPatient));
    EXPECT_EQ(seen.update.sequence, whole.update.sequence);
  }
  for (Client& late : stopped) {
    const auto newest = value_or_fail(late.next_update(kPatient));
    EXPECT_EQ(newest.update.estimate.displacement(0, 0), 30.0);
  }
}

}  // namespace
}  // namespace brainshift::server
