// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/socket.h>

#include <array>
#include <set>

#include "client/tools/bridge/peer.hpp"
#include "client/tools/bridge/socket.hpp"
#include "common/igtl/crc64.hpp"
#include "tests/support/igtl_peer.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

TEST(Address, ReadsWhatItWrites) {
  for (const char* text : {"127.0.0.1:18945", "[::1]:18945", "slicer.local:1", "0.0.0.0:65535"}) {
    const auto address = parse_address("--listen", text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(to_string(*address), text);
  }
  EXPECT_EQ(parse_address("--listen", ":18945").value(), (Address{"127.0.0.1", 18945}))
      << "without an address: this computer alone";
  EXPECT_EQ(parse_address("--listen", "[::1]:0").value(), (Address{"::1", 0}));
}

TEST(Address, RefusesWhatIsUnclear) {
  for (const char* text :
       {"", "18945", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536", "127.0.0.1:-1",
        "127.0.0.1:80 ", "::1:18945", "[::1]", "[]:1", "a b:1", "http://a:1", "a:1:2"}) {
    EXPECT_THAT(refusal_of(parse_address("--listen", text), ErrorCode::kInvalidArgument),
                testing::StartsWith("--listen " + std::string(text) + ": must be ADDRESS:PORT"))
        << text;
  }
}

TEST(Address, KnowsWhatStaysInThisComputer) {
  EXPECT_TRUE(is_loopback({"127.0.0.1", 1}));
  EXPECT_TRUE(is_loopback({"127.1.2.3", 1}));
  EXPECT_TRUE(is_loopback({"::1", 1}));
  EXPECT_TRUE(is_loopback({"localhost", 1}));
  EXPECT_FALSE(is_loopback({"0.0.0.0", 1}));
  EXPECT_FALSE(is_loopback({"::", 1}));
  EXPECT_FALSE(is_loopback({"192.168.0.7", 1}));
}

using test_support::IgtlPeer;

// A volume of 64^3 vectors, 3 MB: far more than a socket's buffers hold.
std::shared_ptr<const Rest> rest() {
  auto made = std::make_shared<Rest>();
  made->geometry.dims = {64, 64, 64};
  made->with_sd = false;
  return made;
}
BroadcastPtr peer_picture(std::uint64_t sequence, bool blank = false) {
  auto made = std::make_shared<Picture>();
  made->rest = rest();
  made->state.sequence = sequence;
  made->state.blank = blank;
  if (!blank) made->u.assign(3 * 64 * 64 * 64, static_cast<float>(sequence));
  return std::make_shared<Broadcast>(made, Broadcast::Part::kWhole,
                                     static_cast<std::uint32_t>(sequence));
}
BroadcastPtr state_of(std::uint64_t sequence) {
  auto made = std::make_shared<Picture>();
  made->state.sequence = sequence;
  return std::make_shared<Broadcast>(made, Broadcast::Part::kState, 0);
}

struct Pair {
  Peer ours;
  IgtlPeer theirs;
};
Pair connected(std::set<std::string, std::less<>> wanted = {"GET_STATUS", "POINT"}) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
  ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  igtl::StreamLimits limits;
  limits.wanted = std::move(wanted);
  return {Peer(Socket(ends[0]), limits), IgtlPeer(ends[1])};
}

const Peer::Sinks ignore{[](igtl::Message&&) {}, [](const std::string&) {}};

// Writes and reads in turns until the device has come.
std::optional<test_support::Received> next_of(Pair& pair, std::string_view device) {
  for (int i = 0; i < 10000; ++i) {
    EXPECT_TRUE(pair.ours.write());
    const auto received = pair.theirs.receive(std::chrono::milliseconds(20));
    if (received && received->message.envelope.device == device) return received;
    if (!received && !pair.ours.wants_to_write()) return std::nullopt;
  }
  return std::nullopt;
}
float peer_first_voxel(const test_support::Received& received) {
  return std::get<std::vector<float>>(std::get<igtl::Image>(received.message.content).voxels)[0];
}

TEST(Peer, SendsAPictureAndThenHasNothingToSend) {
  Pair pair = connected();
  EXPECT_FALSE(pair.ours.wants_to_write());
  pair.ours.offer(peer_picture(1));
  const auto image = next_of(pair, "brainshift_u");
  ASSERT_TRUE(image);
  EXPECT_EQ(peer_first_voxel(*image), 1.0F);
  EXPECT_TRUE(pair.ours.write());
  EXPECT_FALSE(pair.ours.wants_to_write());
  EXPECT_EQ(pair.ours.replaced(), 0u);
}

TEST(Peer, GetsVersionOneUntilItShowsVersionTwoAndThenThePictureAnew) {
  Pair pair = connected();
  pair.ours.offer(peer_picture(1));
  EXPECT_EQ(next_of(pair, "brainshift_u")->header.version, 1);
  igtl::Envelope envelope;
  pair.theirs.send(envelope, igtl::StatusRequest{});
  EXPECT_TRUE(pair.ours.read(ignore));
  EXPECT_EQ(pair.ours.version(), 1);
  EXPECT_FALSE(pair.ours.wants_to_write());
  envelope.version = 2;
  // Of a type that is not wanted: its version counts all the same.
  pair.theirs.send(envelope, igtl::Text{"hello"});
  EXPECT_TRUE(pair.ours.read(ignore));
  EXPECT_EQ(pair.ours.version(), 2);
  const auto again = next_of(pair, "brainshift_u");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->header.version, 2);
  EXPECT_EQ(*igtl::find(again->message.envelope.metadata, "sequence"), "1");
}

TEST(Peer, AReaderThatStallsKeepsTwoPicturesAndThenGetsTheNewest) {
  Pair pair = connected();
  std::vector<std::weak_ptr<Broadcast>> offered;
  for (std::uint64_t sequence = 1; sequence <= 50; ++sequence) {
    const auto broadcast = peer_picture(sequence);
    offered.push_back(broadcast);
    pair.ours.offer(broadcast);
    EXPECT_TRUE(pair.ours.write());
  }
  const auto alive = std::count_if(offered.begin(), offered.end(),
                                   [](const auto& each) { return !each.expired(); });
  EXPECT_EQ(alive, 2) << "the one that is being written, and the newest";
  EXPECT_EQ(pair.ours.replaced(), 48u);
  EXPECT_EQ(peer_first_voxel(*next_of(pair, "brainshift_u")), 1.0F) << "was under way";
  EXPECT_EQ(peer_first_voxel(*next_of(pair, "brainshift_u")), 50.0F);
  EXPECT_FALSE(next_of(pair, "brainshift_u")) << "and nothing in between";
}

TEST(Peer, ABlankPictureWaitsForTheEndOfAMessageOnly) {
  Pair pair = connected();
  auto many = std::make_shared<Picture>(peer_picture(1)->picture());
  auto with_sd = std::make_shared<Rest>(*rest());
  with_sd->with_sd = true;
  many->rest = with_sd;
  pair.ours.offer(std::make_shared<Broadcast>(many, Broadcast::Part::kWhole, 1));
  EXPECT_TRUE(pair.ours.write());  // stops within brainshift_u
  pair.ours.offer(peer_picture(0, true));
  EXPECT_EQ(peer_first_voxel(*next_of(pair, "brainshift_u")), 1.0F);
  const auto next = next_of(pair, "brainshift_u");
  ASSERT_TRUE(next);
  EXPECT_EQ(peer_first_voxel(*next), 0.0F) << "without brainshift_sd of the picture before";
}

TEST(Peer, TheStateAloneTakesNoPicturesPlace) {
  Pair pair = connected();
  pair.ours.offer(peer_picture(1));
  EXPECT_TRUE(pair.ours.write());
  pair.ours.offer(peer_picture(2));
  pair.ours.offer(state_of(3));
  EXPECT_EQ(peer_first_voxel(*next_of(pair, "brainshift_u")), 1.0F);
  EXPECT_EQ(peer_first_voxel(*next_of(pair, "brainshift_u")), 2.0F);
  EXPECT_TRUE(next_of(pair, "brainshift_state"));
  EXPECT_EQ(pair.ours.replaced(), 0u);
}

TEST(Peer, RepliesComeBeforeTheNextMessageAndAreLimited) {
  Pair pair = connected();
  pair.ours.offer(peer_picture(1));
  igtl::Envelope envelope;
  envelope.device = "reply";
  EXPECT_TRUE(pair.ours.reply(envelope, igtl::StatusReport{}));
  EXPECT_TRUE(pair.ours.write());
  EXPECT_EQ(pair.theirs.receive()->message.envelope.device, "reply");
  Status status;
  for (std::size_t i = 0; i <= Peer::kMaxReplies && status; ++i) {
    status = pair.ours.reply(envelope, igtl::StatusReport{});
  }
  EXPECT_FALSE(status);
}

TEST(Peer, HandsOnWhatIsWantedAndNoticesTheEnd) {
  Pair pair = connected();
  std::vector<std::string> devices;
  const Peer::Sinks note{
      [&](igtl::Message&& message) { devices.push_back(message.envelope.device); },
      [](const std::string& sentence) { ADD_FAILURE() << sentence; }};
  igtl::Envelope envelope;
  envelope.device = "a";
  pair.theirs.send(envelope, igtl::PointList{});
  envelope.device = "b";
  pair.theirs.send(envelope, igtl::Text{"not wanted"});
  envelope.device = "c";
  pair.theirs.send(envelope, igtl::StatusRequest{});
  EXPECT_TRUE(pair.ours.read(note));
  EXPECT_THAT(devices, testing::ElementsAre("a", "c"));
  { const IgtlPeer closes = std::move(pair.theirs); }
  refusal_of(pair.ours.read(note), ErrorCode::kUnavailable);
}

TEST(Peer, AMessageThatIsNotUnderstoodIsToldAndAnImageCountsAllTheSame) {
  Pair pair = connected({"IMAGE", "POINT"});
  std::vector<std::string> told, taken;
  const Peer::Sinks sinks{
      [&](igtl::Message&& message) { taken.push_back(message.envelope.device); },
      [&](const std::string& sentence) { told.push_back(sentence); }};
  const auto send = [&](const std::string& type, const std::string& device) {
    const std::string body = "nonsense";
    igtl::Header header{1, type, device, 0, body.size(), igtl::crc64(body)};
    pair.theirs.send(igtl::encode_header(header) + body);
  };
  for (int i = 0; i < 5; ++i) send("POINT", "Tum");
  send("IMAGE", "US");
  EXPECT_TRUE(pair.ours.read(sinks));
  EXPECT_THAT(taken, testing::ElementsAre("US"));
  ASSERT_EQ(told.size(), 3u) << "the first, the second, the fourth";
  EXPECT_THAT(told[0], testing::StartsWith("POINT of Tum left out: POINT: "));
  EXPECT_THAT(told[2], testing::EndsWith("(4 messages so far)"));
}

TEST(Peer, WhatIsNoOpenIgtLinkEndsIt) {
  Pair pair = connected();
  pair.theirs.send(
      std::string("GET / HTTP/1.1\r\nHost: localhost\r\nAccept: everything there is\r\n"));
  refusal_of(pair.ours.read(ignore), ErrorCode::kProtocol);
}

}  // namespace
}  // namespace brainshift::client
