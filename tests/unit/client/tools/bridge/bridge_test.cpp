// SPDX-License-Identifier: GPL-3.0-or-later
// The whole of it runs in tests/integration/test_bridge.py.
#include <gmock/gmock.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <future>
#include <mutex>
#include <thread>

#include "client/tools/bridge/bridge.hpp"
#include "client/tools/bridge/hub.hpp"
#include "tests/support/igtl_peer.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using test_support::IgtlListener;
using test_support::IgtlPeer;
using testing::HasSubstr;

PicturePtr picture(std::uint64_t sequence, int side = 4) {
  auto rest = std::make_shared<Rest>();
  rest->geometry.dims = {side, side, side};
  rest->with_sd = false;
  auto made = std::make_shared<Picture>();
  made->rest = rest;
  made->state.sequence = sequence;
  made->state.blank = false;
  made->state.currency = Currency::kCurrent;
  made->u.assign(static_cast<std::size_t>(3 * side * side * side), static_cast<float>(sequence));
  return made;
}

class HubOnLoopback : public testing::Test {
 protected:
  void serve(HubOptions options = {}) {
    options.listen = {"127.0.0.1", 0};
    hub = Hub::open(
              options,
              [this](const std::string& sentence) {
                const std::lock_guard lock(mutex);
                told.push_back(sentence);
              },
              [this](igtl::Message&& message) { received.set_value(std::move(message)); })
              .value();
    thread = std::thread([this] { EXPECT_TRUE(hub->run(stop_descriptor)); });
  }
  void end() {
    const std::uint64_t one = 1;
    ASSERT_EQ(::write(stop_descriptor, &one, sizeof one), 8);
    thread.join();
  }
  void TearDown() override {
    if (thread.joinable()) end();
    ::close(stop_descriptor);
  }
  IgtlPeer client() { return IgtlPeer::connect(hub->address().port); }
  void post(std::uint64_t sequence) { hub->post(picture(sequence), Broadcast::Part::kWhole); }

  int stop_descriptor = eventfd(0, EFD_CLOEXEC);
  std::unique_ptr<Hub> hub;
  std::thread thread;
  std::mutex mutex;
  std::vector<std::string> told;
  std::promise<igtl::Message> received;
};

float first_voxel(const std::optional<test_support::Received>& image) {
  if (!image) return -1.0F;
  return std::get<std::vector<float>>(std::get<igtl::Image>(image->message.content).voxels)[0];
}

TEST_F(HubOnLoopback, EveryClientGetsWhatIsPostedAndANewOneWhatStands) {
  serve();
  IgtlPeer first = client();
  post(1);
  EXPECT_EQ(first_voxel(first.receive_from("brainshift_u")), 1.0F);
  IgtlPeer second = client();
  EXPECT_EQ(first_voxel(second.receive_from("brainshift_u")), 1.0F);
  post(2);
  EXPECT_EQ(first_voxel(first.receive_from("brainshift_u")), 2.0F);
  EXPECT_EQ(first_voxel(second.receive_from("brainshift_u")), 2.0F);
  EXPECT_EQ(hub->peers(), 2);
}

TEST_F(HubOnLoopback, AnswersRequestsInTheClientsVersion) {
  serve();
  post(1);
  IgtlPeer old = client();
  ASSERT_TRUE(old.receive_from("brainshift_u"));
  igtl::Envelope envelope;
  envelope.device = "asks";
  old.send(envelope, igtl::StatusRequest{});
  const auto status = old.receive();
  ASSERT_TRUE(status);
  EXPECT_EQ(status->header.version, 1);
  EXPECT_EQ(std::get<igtl::StatusReport>(status->message.content).code, igtl::kStatusOk);
  old.send(envelope, igtl::CapabilityRequest{});
  const auto can = old.receive();
  ASSERT_TRUE(can);
  EXPECT_THAT(std::get<igtl::Capability>(can->message.content).types, testing::Contains("IMAGE"));

  IgtlPeer modern = client();
  envelope.version = 2;
  modern.send(envelope, igtl::StatusRequest{});
  for (int i = 0; i < 20; ++i) {
    const auto message = modern.receive();
    ASSERT_TRUE(message);
    if (message->header.version == 2) return;
  }
  FAIL() << "never version 2";
}

// The follower's thread hangs: GET_STATUS and the volumes say so, until it posts again.
TEST_F(HubOnLoopback, BlanksByItselfWhenItsFollowerFallsSilent) {
  HubOptions options;
  options.silence = std::chrono::milliseconds(300);
  serve(options);
  post(1);
  IgtlPeer viewer = client();
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 1.0F);
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 0.0F);
  igtl::Envelope envelope;
  viewer.send(envelope, igtl::StatusRequest{});
  const auto status = viewer.receive_from("brainshift");
  ASSERT_TRUE(status);
  const auto& report = std::get<igtl::StatusReport>(status->message.content);
  EXPECT_EQ(report.code, igtl::kStatusNotReady);
  EXPECT_THAT(report.text, HasSubstr("has not looked at the daemon for"));
  hub->post(picture(1), Broadcast::Part::kState);
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 1.0F) << "what stood comes back";
}

TEST_F(HubOnLoopback, ANewClientLearnsTheNewestAge) {
  serve();
  post(1);
  auto later = std::make_shared<Picture>(*picture(1));
  later->state.age_ms = 4321.0;
  IgtlPeer first = client();
  ASSERT_TRUE(first.receive_from("brainshift_u"));
  hub->post(later, Broadcast::Part::kState);
  ASSERT_TRUE(first.receive_from("brainshift_state"));
  IgtlPeer second = client();
  ASSERT_TRUE(second.receive_from("brainshift_u"));
  const auto said = second.receive_from("brainshift_state");
  ASSERT_TRUE(said);
  EXPECT_THAT(std::get<igtl::Text>(said->message.content).text, HasSubstr("\"age_ms\":4321"));
}

TEST_F(HubOnLoopback, BlanksBeforeItEnds) {
  serve();
  post(1);
  IgtlPeer viewer = client();
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 1.0F);
  end();
  const auto status = viewer.receive_from("brainshift");
  ASSERT_TRUE(status);
  EXPECT_EQ(std::get<igtl::StatusReport>(status->message.content).text, "the bridge has ended");
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 0.0F);
}

// A client that does not read keeps the hub for the second that a goodbye may take.
TEST_F(HubOnLoopback, WhatIsPostedAfterTheGoodbyeDoesNotReplaceIt) {
  serve();
  const IgtlPeer stalled = IgtlPeer::connect(hub->address().port, 4096);
  IgtlPeer viewer = client();
  hub->post(picture(1, 96), Broadcast::Part::kWhole);  // 11 MB: more than sockets hold
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 1.0F);
  const std::uint64_t one = 1;
  ASSERT_EQ(::write(stop_descriptor, &one, sizeof one), 8);
  EXPECT_EQ(first_voxel(viewer.receive_from("brainshift_u")), 0.0F);
  post(2);
  while (const auto later = viewer.receive()) EXPECT_NE(later->header.device, "brainshift_u");
  thread.join();
}

TEST_F(HubOnLoopback, TurnsAwayMoreClientsThanItHasRoomFor) {
  HubOptions options;
  options.max_peers = 1;
  serve(options);
  post(1);
  IgtlPeer first = client();
  ASSERT_TRUE(first.receive_from("brainshift_u"));
  IgtlPeer second = client();
  EXPECT_FALSE(second.receive());
  post(2);
  EXPECT_EQ(first_voxel(first.receive_from("brainshift_u")), 2.0F);
}

TEST_F(HubOnLoopback, AClientThatDoesNotReadMakesRoomForOneThatDoes) {
  HubOptions options;
  options.max_peers = 1;
  options.unread = std::chrono::milliseconds(50);
  serve(options);
  hub->post(picture(1, 160), Broadcast::Part::kWhole);  // 49 MB: more than its sockets hold
  IgtlPeer idle = IgtlPeer::connect(hub->address().port, 4096);
  std::optional<test_support::Received> shown;
  const auto deadline = std::chrono::steady_clock::now() + IgtlPeer::kLimit;
  while (!shown && std::chrono::steady_clock::now() < deadline) {
    IgtlPeer reader = client();  // nothing comes where it is turned away
    shown = reader.receive_from("brainshift_u");
  }
  EXPECT_EQ(first_voxel(shown), 1.0F);
}

TEST_F(HubOnLoopback, AClientThatTalksNonsenseIsClosedAndTheOthersGoOn) {
  serve();
  IgtlPeer good = client();
  IgtlPeer bad = client();
  bad.send(std::string(200, 'x'));
  EXPECT_FALSE(bad.receive());
  post(1);
  EXPECT_EQ(first_voxel(good.receive_from("brainshift_u")), 1.0F);
}

TEST_F(HubOnLoopback, HandsOnWhatItsClientsSend) {
  HubOptions options;
  options.from_peers.wanted = {"POINT"};
  serve(options);
  IgtlPeer slicer = client();
  igtl::Envelope envelope;
  envelope.version = 2;
  envelope.device = "TumourNow";
  igtl::PointList list;
  list.points.resize(2);
  slicer.send(envelope, list);
  EXPECT_EQ(received.get_future().get().envelope.device, "TumourNow");
}

// The bridge as a client: it speaks version 2 first, and comes back after the server has gone.
TEST_F(HubOnLoopback, GreetsAServerInVersionTwoAndConnectsAnew) {
  IgtlListener plus;
  HubOptions options;
  options.from = Address{"127.0.0.1", plus.port()};
  options.from_upstream.wanted = {"TRANSFORM"};
  serve(options);
  {
    IgtlPeer server = plus.accept();
    const auto greeting = server.receive();
    ASSERT_TRUE(greeting);
    EXPECT_EQ(greeting->header.version, 2);
    EXPECT_EQ(greeting->header.type, "STATUS") << "a GET_STATUS crashes OpenIGTLink's receivers";
  }
  IgtlPeer server = plus.accept();
  EXPECT_EQ(server.receive()->header.type, "STATUS");
  igtl::Envelope envelope;
  envelope.version = 2;
  envelope.device = "ProbeToTracker";
  server.send(envelope, igtl::Transform{});
  EXPECT_EQ(received.get_future().get().envelope.device, "ProbeToTracker");
  const std::lock_guard lock(mutex);
  EXPECT_THAT(told, testing::Contains(HasSubstr(": connected")));
  EXPECT_THAT(told, testing::Contains(HasSubstr("trying again")));
}

std::string refusal(const BridgeOptions& options) {
  const auto bridge = Bridge::open(options, [](const std::string&) {});
  return bridge ? "" : bridge.error().message;
}

BridgeOptions quiet() {
  BridgeOptions options;
  options.listen.port = 0;
  return options;
}

TEST(Bridge, ListensOnAPortOfItsOwnAndEndsWhenToldTo) {
  BridgeOptions options = quiet();
  options.endpoint = "tcp://127.0.0.1:1";  // nobody
  const auto bridge = Bridge::open(options, [](const std::string&) {}).value();
  EXPECT_GT(bridge->address().port, 0);
  EXPECT_TRUE(is_loopback(bridge->address()));
  bridge->stop();
  EXPECT_TRUE(bridge->run());
}

TEST(Bridge, AnEndpointThatIsNoneEndsIt) {
  BridgeOptions options = quiet();
  options.endpoint = "no endpoint";
  const auto bridge = Bridge::open(options, [](const std::string&) {}).value();
  refusal_of(bridge->run(), ErrorCode::kInvalidArgument);
}

TEST(Bridge, RefusesOptionsThatDoNotBelongTogether) {
  BridgeOptions options = quiet();
  options.from = Address{"127.0.0.1", 18944};
  EXPECT_THAT(refusal(options), HasSubstr("say what of it to use"));
  options.inbox.tumour_device = "Tumour";
  EXPECT_EQ(refusal(options), "");
  options.from->port = 0;
  EXPECT_THAT(refusal(options), HasSubstr("1 to 65535"));

  options = quiet();
  options.inbox.seeds = "seeds.csv";
  EXPECT_THAT(refusal(options), HasSubstr("--from"));
  options.from = Address{"127.0.0.1", 18944};
  EXPECT_THAT(refusal(options), HasSubstr("--registration is required"));
  options.inbox.registration = "nowhere.txt";
  EXPECT_THAT(refusal(options), HasSubstr("nowhere.txt"));
  options.inbox.contours = "contours.csv";
  EXPECT_THAT(refusal(options), HasSubstr("at most one"));

  options = quiet();
  options.inbox.landmarks_after = "F";
  EXPECT_THAT(refusal(options), HasSubstr("both or none"));
  options = quiet();
  options.inbox.sd_mm = 0.0;
  EXPECT_THAT(refusal(options), HasSubstr("--sd-mm 0"));
  options = quiet();
  options.inbox.sweep_gap_s = -1.0;
  EXPECT_THAT(refusal(options), HasSubstr("--sweeps -1"));
}

TEST(Bridge, APortThatIsTakenIsNamed) {
  const auto first = Bridge::open(quiet(), [](const std::string&) {}).value();
  BridgeOptions second = quiet();
  second.listen = first->address();
  EXPECT_THAT(refusal(second), HasSubstr("cannot listen on " + to_string(first->address())));
  second.listen = {"192.0.2.1", 0};  // reserved for documents: no address of this computer
  EXPECT_THAT(refusal(second), HasSubstr("192.0.2.1"));
}

}  // namespace
}  // namespace brainshift::client
