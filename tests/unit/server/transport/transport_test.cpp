// SPDX-License-Identifier: GPL-3.0-or-later
// Requests, good, bad and malformed, and the parts of the transport.
#include <gmock/gmock.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "server/transport/peers.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

// ---------- requests ----------

TEST_F(TransportTest, ADaemonWithoutAModelSaysSo) {
  serve(without_model());
  RawPeer peer(endpoint_);
  const auto status =
      value_or_fail(wire::decode_status(peer.ask(MessageType::kStatusRequest).payload));
  EXPECT_FALSE(status.model_ready);
  EXPECT_EQ(status.version, "1.2.3");
  EXPECT_EQ(error_of(peer.ask(MessageType::kModelRequest)).code, ErrorCode::kModelNotReady);
  EXPECT_EQ(error_of(peer.hand_in(landmarks(1))).code, ErrorCode::kModelNotReady);
  const auto start = peer.start(session_of(), 77);
  EXPECT_EQ(start.request_id, 77u);
  EXPECT_EQ(error_of(start).code, ErrorCode::kModelNotReady);
  EXPECT_EQ(error_of(start).message, "no model is loaded");
}

TEST_F(TransportTest, AnswersStatusModelAndSession) {
  serve(with_model());
  RawPeer peer(endpoint_);
  const auto model =
      value_or_fail(wire::decode_model(peer.ask(MessageType::kModelRequest).payload));
  EXPECT_EQ(model.mesh.nodes, small_model()->mesh.nodes);
  start_session(peer);
  const auto status =
      value_or_fail(wire::decode_status(peer.ask(MessageType::kStatusRequest).payload));
  EXPECT_TRUE(status.model_ready);
  EXPECT_EQ(status.case_id, kCase);
  const SessionState state = renew(peer, {1, 1, 0});
  EXPECT_EQ(state.session, (SessionKey{kBootId, 1, kModelId}));
  EXPECT_EQ(state.phase, SessionPhase::kReady);
  EXPECT_EQ(state.newest_update, 0u);
  EXPECT_EQ(state.valid_ms, 1000u);
}

TEST_F(TransportTest, WhatIsRefusedIsToldWithItsReason) {
  serve(with_model());
  RawPeer peer(endpoint_);
  const Error early = error_of(peer.hand_in(landmarks(1)));
  EXPECT_EQ(early.code, ErrorCode::kModelNotReady);
  EXPECT_THAT(early.message, HasSubstr("no session"));
  start_session(peer);
  Observation other_case = landmarks(1);
  other_case.case_id = "someone-else";
  const Error other = error_of(peer.hand_in(other_case));
  EXPECT_EQ(other.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(other.message, HasSubstr("someone-else"));
  Observation not_finite = landmarks(1);
  std::get<LandmarkPairs>(not_finite.body).deformed(0, 0) =
      std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(peer.hand_in(not_finite)).code, ErrorCode::kNotFinite);
  const auto start = peer.start(session_of("someone-else"), 5);
  EXPECT_EQ(start.request_id, 5u);
  EXPECT_EQ(error_of(start).code, ErrorCode::kInvalidArgument);
}

// ---------- malformed messages ----------

TEST_F(TransportTest, AnswersGarbageWithAProtocolError) {
  serve(with_model());
  RawPeer peer(endpoint_);
  for (const std::string& garbage :
       {std::string(), std::string("x"), std::string(24, '\0'), std::string(10'000, '\xff'),
        std::string("GET / HTTP/1.1\r\n\r\n")}) {
    peer.send(garbage);
    EXPECT_EQ(error_of(peer.receive()).code, ErrorCode::kProtocol);
  }
  EXPECT_TRUE(peer.is_served());
}

TEST_F(TransportTest, AnyDamagedByteOfARequestIsNoticed) {
  serve(with_model());
  RawPeer peer(endpoint_);
  const std::string good =
      wire::encode_frame(MessageType::kStartSessionRequest, 3, wire::encode(session_of()));
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string damaged = good;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
    peer.send(damaged);
    EXPECT_EQ(error_of(peer.receive()).code, ErrorCode::kProtocol) << "byte " << i;
  }
}

TEST_F(TransportTest, WellFramedRubbishIsAProtocolErrorWithTheRequestsId) {
  serve(with_model());
  RawPeer peer(endpoint_);
  start_session(peer);
  const auto observation = peer.ask(MessageType::kObservation, "\xff\xff\xff rubbish", 9);
  EXPECT_EQ(observation.request_id, 9u);
  EXPECT_EQ(error_of(observation).code, ErrorCode::kProtocol);
  EXPECT_EQ(error_of(peer.ask(MessageType::kStartSessionRequest, "\xff\xff rubbish")).code,
            ErrorCode::kProtocol);
}

TEST_F(TransportTest, ATypeThatIsNoRequestIsAProtocolError) {
  serve(with_model());
  RawPeer peer(endpoint_);
  for (const MessageType type : {MessageType::kStatusReply, MessageType::kUpdate,
                                 MessageType::kErrorReply, MessageType::kModelReply}) {
    const Error error = error_of(peer.ask(type));
    EXPECT_EQ(error.code, ErrorCode::kProtocol);
    EXPECT_THAT(error.message, HasSubstr("is not a request"));
  }
}

TEST_F(TransportTest, AMessageOfSeveralPartsIsAProtocolError) {
  serve(with_model());
  RawPeer peer(endpoint_);
  peer.send_parts(500);
  const Error error = error_of(peer.receive());
  EXPECT_EQ(error.code, ErrorCode::kProtocol);
  EXPECT_THAT(error.message, HasSubstr("500"));
  EXPECT_TRUE(peer.is_served());
}

TEST_F(TransportTest, AnOversizedMessageEndsItsConnectionOnly) {
  RouterOptions options;
  options.max_message_mib = 1;
  serve(with_model(), options);
  RawPeer other(endpoint_);
  ASSERT_TRUE(other.is_served());
  RawPeer large(endpoint_);
  large.send(std::string(2 << 20, 'x'));
  // Its connection is closed, and what was under way on it is lost; it is served on the next one.
  EXPECT_TRUE(large.keeps_asking_until_answered());
  EXPECT_TRUE(other.is_served());
}

// ---------- many peers, many requests ----------

TEST_F(TransportTest, BadPeersTakeNobodysPlace) {
  RouterOptions options;
  options.max_clients = 2;
  serve(with_model(), options);
  std::vector<std::unique_ptr<RawPeer>> bad;
  for (int i = 0; i < 8; ++i) {
    bad.push_back(std::make_unique<RawPeer>(endpoint_));
    bad.back()->send("x");
    EXPECT_EQ(error_of(bad.back()->receive()).code, ErrorCode::kProtocol);
  }
  expect_alive();
}

// More requests than the queue of a connection holds: every one is answered, in order.
TEST_F(TransportTest, ManyRequestsInFlightAreAllAnswered) {
  RouterOptions options;
  options.send_queue = 2;
  serve(with_model(), options);
  RawPeer peer(endpoint_, 1);
  constexpr std::uint64_t kRequests = 200;
  for (std::uint64_t id = 1; id <= kRequests; ++id) {
    peer.request(MessageType::kStatusRequest, {}, id);
  }
  for (std::uint64_t id = 1; id <= kRequests; ++id) ASSERT_EQ(peer.receive().request_id, id);
}

TEST_F(TransportTest, ARequestThatCarriesNothingMustBeEmpty) {
  serve(with_model());
  RawPeer peer(endpoint_);
  for (const MessageType type : {MessageType::kStatusRequest, MessageType::kModelRequest}) {
    const Error error = error_of(peer.ask(type, "rubbish"));
    EXPECT_EQ(error.code, ErrorCode::kProtocol);
    EXPECT_THAT(error.message, HasSubstr("must be empty"));
  }
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
  const Error refused = error_of(third.ask(MessageType::kModelRequest));
  EXPECT_EQ(refused.code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.message, HasSubstr("2 clients"));
  EXPECT_TRUE(third.is_served()) << "that the daemon lives is told without a place";
  EXPECT_EQ(third.ask(MessageType::kReportRequest).type, MessageType::kReportReply);
  second.reset();
  EXPECT_TRUE(eventually(
      [&] { return third.ask(MessageType::kModelRequest).type == MessageType::kModelReply; }));
}

// What stands for any allocation of the transport thread that fails.
TEST_F(TransportTest, AnExceptionOnTheTransportThreadCostsOneStep) {
  ServiceOptions options = with_model();
  options.on_turn = [turns = 0]() mutable {
    if (++turns <= 3) throw std::bad_alloc();
  };
  serve(std::move(options));
  RawPeer peer(endpoint_);
  for (int i = 0; i < 5; ++i) peer.ask(MessageType::kReportRequest);
  EXPECT_TRUE(peer.is_served());
}

// ---------- binding ----------

TEST(Router, RefusesAnEndpointThatIsNone) {
  for (const char* endpoint : {"", "nonsense", "ftp://127.0.0.1:1", "tcp://127.0.0.1:99999",
                               "tcp://127.0.0.1:-1", "tcp://127.0.0.1:80x", "tcp://127.0.0.1"}) {
    RouterOptions options;
    options.endpoint = endpoint;
    EXPECT_THAT(refusal_of(Router::bind(options), ErrorCode::kInvalidArgument),
                HasSubstr(endpoint));
  }
}

TEST(Router, APortInUseIsUnavailable) {
  const auto first = value_or_fail(Router::bind({}));
  RouterOptions options;
  options.endpoint = first.endpoint();
  refusal_of(Router::bind(options), ErrorCode::kUnavailable);
}

// ---------- parts ----------

TEST(Outbox, KeepsTheNewestIteratesAndEverythingElse) {
  Outbox outbox;
  const auto bytes = [](const char* text) { return std::make_shared<const std::string>(text); };
  outbox.post({Delivery::kFinal, {}, bytes("final")});
  for (const char* text : {"1", "2", "3", "4", "5", "6"}) {
    outbox.post({Delivery::kIterate, {}, bytes(text)});
  }
  outbox.post({Delivery::kReply, "peer", bytes("reply")});
  std::vector<std::string> taken;
  for (const Outgoing& message : outbox.take()) taken.push_back(*message.bytes);
  EXPECT_THAT(taken, testing::ElementsAre("final", "3", "4", "5", "6", "reply"));
  EXPECT_TRUE(outbox.take().empty());
}

TEST(Peers, RepliesThatWaitAreBoundedInNumberAndBytes) {
  const auto reply = [](std::size_t size) {
    return std::make_shared<const std::string>(size, 'x');
  };
  Peer peer;
  EXPECT_TRUE(peer.may_wait(reply(Peer::kMaxReplyBytes + 1))) << "one always may";
  peer.replies.push_back(reply(1));
  peer.reply_bytes = Peer::kMaxReplyBytes - 10;
  EXPECT_TRUE(peer.may_wait(reply(10)));
  EXPECT_FALSE(peer.may_wait(reply(11)));
  peer.reply_bytes = 0;
  while (peer.replies.size() < Peer::kMaxReplies) peer.replies.push_back(reply(0));
  EXPECT_FALSE(peer.may_wait(reply(0)));
}

TEST(Peers, AConnectionThatClosesTakesItsPeerAlong) {
  Peers peers(2);
  ASSERT_NE(peers.add("a", 10), nullptr);
  ASSERT_NE(peers.add("b", 11), nullptr);
  EXPECT_EQ(peers.add("c", 12), nullptr);
  EXPECT_NE(peers.add("a", 10), nullptr);
  EXPECT_THAT(peers.remove_connection(10), testing::ElementsAre("a"));
  EXPECT_TRUE(peers.remove_connection(10).empty());
  EXPECT_NE(peers.add("c", 12), nullptr);
  EXPECT_EQ(peers.find("a"), nullptr);
}

}  // namespace
}  // namespace brainshift::server
