// SPDX-License-Identifier: GPL-3.0-or-later
// Peers that flood, stall or crowd: what the daemon keeps stays bounded, and others are served.
#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "common/wire/report.hpp"
#include "server/guard/process_limits.hpp"
#include "tests/support/zmtp_peer.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using test_support::port_of;
using test_support::ZmtpPeer;
using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryTells = false;  // sanitizers keep what was freed
#else
constexpr bool kMemoryTells = true;
#endif
constexpr double kMaxMib = 64.0;

double resident_mib() {
  std::ifstream statm("/proc/self/statm");
  long all = 0, resident = 0;
  statm >> all >> resident;
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / (1 << 20);
}

class Flood : public TransportTest {
 protected:
  Flood() { return_large_blocks(); }

  void served_within_two_seconds() {
    RawPeer peer(endpoint_);
    const auto begin = Clock::now();
    EXPECT_TRUE(peer.is_served());
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(2));
  }
  void bounded_since(double idle_mib, const char* what) {
    const double grown = resident_mib() - idle_mib;
    std::printf("%s: %.1f MiB above idle\n", what, grown);
    EXPECT_TRUE(!kMemoryTells || grown < kMaxMib) << what;
  }
};

TEST_F(Flood, EndlessPartsOfOneMessageEndTheConnection) {
  serve(with_model());
  served_within_two_seconds();
  std::string parts;  // without a byte, and more to follow
  for (int i = 0; i < 500'000; ++i) parts += std::string("\1\0", 2);
  const double idle = resident_mib();
  for (int i = 0; i < 20; ++i) {
    ZmtpPeer peer(port_of(endpoint_));
    peer.shake_hands();
    peer.send_bytes(parts);  // may end early
    EXPECT_TRUE(peer.sees_the_end());
  }
  bounded_since(idle, "ten million empty parts");
  served_within_two_seconds();
  RawPeer asking(endpoint_);
  const auto report = wire::decode_report(asking.ask(MessageType::kReportRequest).payload);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->door.closed_for_breach, 20u);
  EXPECT_GE(report->door.accepted, 23u);
}

TEST_F(Flood, UnfinishedMessagesOfManyPeersHoldABoundedAmount) {
  serve(with_model());
  RawPeer viewer(endpoint_);
  EXPECT_TRUE(viewer.is_served());
  const std::string most(15u << 20, 'x');
  const double idle = resident_mib();
  std::vector<ZmtpPeer> peers;
  for (int i = 0; i < 32; ++i) {
    peers.emplace_back(port_of(endpoint_));
    peers.back().shake_hands();
    peers.back().claim_part(16u << 20);
    peers.back().send_bytes(most);
    if (i % 8 == 7) {
      served_within_two_seconds();
      bounded_since(idle, "unfinished messages of 15 MiB");
    }
  }
  EXPECT_GE(router_->guard_counts().closed_for_memory, 28u);
  EXPECT_TRUE(viewer.is_served());
}

TEST_F(Flood, AMessageThatNeverEndsEndsWithPatience) {
  RouterOptions options;
  options.patience = std::chrono::milliseconds(200);
  serve(with_model(), options);
  ZmtpPeer peer(port_of(endpoint_));
  peer.shake_hands();
  peer.claim_part(1000);
  peer.send_bytes("begun");
  EXPECT_TRUE(peer.sees_the_end());
  EXPECT_EQ(router_->guard_counts().closed_for_silence, 1u);
  RawPeer idle(endpoint_);
  EXPECT_TRUE(idle.is_served());
}

TEST_F(Flood, WithKeysAMessageOfManyPartsIsNoWayRoundTheBound) {
  char public_key[41];
  char secret_key[41];
  char own_public[41];
  char own_secret[41];
  ASSERT_EQ(zmq_curve_keypair(public_key, secret_key), 0);
  ASSERT_EQ(zmq_curve_keypair(own_public, own_secret), 0);
  RouterOptions options;
  options.keys = ServerKeys{secret_key, {{own_public, "peer"}}, {{"peer", Role::kViewer}}};
  options.patience = std::chrono::milliseconds(300);
  serve(with_model(), options);
  const auto with_keys = [&](zmq::socket_t& socket) {
    socket.set(zmq::sockopt::curve_serverkey, std::string(public_key));
    socket.set(zmq::sockopt::curve_publickey, std::string(own_public));
    socket.set(zmq::sockopt::curve_secretkey, std::string(own_secret));
  };
  RawPeer other(endpoint_, 1000, with_keys);
  EXPECT_TRUE(other.is_served());
  const double idle = resident_mib();
  RawPeer many(endpoint_, 1000, with_keys);
  many.send_parts(200'000);
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(other.is_served());
    return router_->guard_counts().closed_for_silence >= 1;
  }));
  bounded_since(idle, "200,000 encrypted parts, with those that the sender keeps");
}

TEST_F(Flood, ManyConnectionsThatSayNothingMakeRoomForOneThatDoes) {
  RouterOptions options;
  options.max_connections = 20;
  serve(with_model(), options);
  RawPeer known(endpoint_);
  EXPECT_TRUE(known.is_served());
  std::vector<ZmtpPeer> silent;
  for (int i = 0; i < 100; ++i) silent.emplace_back(port_of(endpoint_));
  served_within_two_seconds();
  EXPECT_TRUE(known.is_served());
  EXPECT_GE(router_->guard_counts().closed_for_room, 80u);
}

TEST_F(Flood, ThirtyTwoPeersWithABadByteEachLockNobodyOut) {
  serve(with_model());
  std::vector<ZmtpPeer> bad;
  for (int i = 0; i < 32; ++i) {
    bad.emplace_back(port_of(endpoint_));
    bad.back().send_bytes("x");
  }
  for (int i = 0; i < 32; ++i) {
    bad.emplace_back(port_of(endpoint_));
    bad.back().shake_hands();
    bad.back().send_part("x", false);  // a message of one byte
  }
  served_within_two_seconds();
  EXPECT_EQ(router_->guard_counts().closed_for_breach, 32u);
}

TEST_F(Flood, TheFirstOfTwoPeersWithOneRoutingIdStaysAndTheSecondIsClosed) {
  serve(with_model());
  const auto named = [](zmq::socket_t& socket) {
    socket.set(zmq::sockopt::routing_id, std::string("console"));
  };
  RawPeer first(endpoint_, 1000, named);
  EXPECT_TRUE(first.is_served());
  {
    RawPeer second(endpoint_, 1000, named);
    second.request(MessageType::kStatusRequest);
    EXPECT_TRUE(eventually([&] {
      EXPECT_TRUE(first.is_served());
      return router_->guard_counts().closed_for_breach >= 1;
    }));
  }
  EXPECT_TRUE(first.is_served());
}

// libzmq aborts the process when it has stopped reading a connection that then closes with a
// heartbeat unread.
TEST_F(Flood, RequestsAHeartbeatAndAHangUpAtOnceEndNothing) {
  serve(with_model());
  const std::string request = wire::encode_frame(MessageType::kReportRequest, 1, {});
  const std::string ping = std::string("\4\7\4PING", 7) + std::string(2, '\0');
  for (int i = 0; i < 200; ++i) {
    ZmtpPeer peer(port_of(endpoint_));
    ASSERT_TRUE(peer.shake_hands());
    std::string all;
    for (int k = 0; k < 40; ++k) {
      all += '\0';
      all += static_cast<char>(request.size());
      all += request;
    }
    peer.send_bytes(all + ping);
  }
  served_within_two_seconds();
}

TEST_F(Flood, LargeMessagesOfAGoodClientArePassedOnWhole) {
  serve(with_model());
  RawPeer peer(endpoint_);
  for (int i = 0; i < 4; ++i) {
    const Received reply = peer.ask(MessageType::kStatusRequest, std::string(10u << 20, 'x'), 3);
    EXPECT_EQ(reply.request_id, 3u);
    EXPECT_EQ(error_of(reply).code, ErrorCode::kProtocol) << "a status request is empty";
  }
  EXPECT_EQ(router_->guard_counts().closed_for_memory, 0u);
}

}  // namespace
}  // namespace brainshift::server
