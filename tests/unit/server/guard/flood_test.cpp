// SPDX-License-Identifier: GPL-3.0-or-later
// Peers that flood, stall or crowd: what the daemon keeps stays bounded, and others are served.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/wire/report.hpp"
#include "server/guard/process_limits.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryTells = false;  // sanitizers keep what was freed
#else
constexpr bool kMemoryTells = true;
#endif
constexpr double kMostMib = 64.0;

double resident_mib() {
  std::ifstream statm("/proc/self/statm");
  long all = 0;
  long resident = 0;
  statm >> all >> resident;
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / (1 << 20);
}

// A peer that speaks ZMTP byte by byte, without keys.
class Socket {
 public:
  explicit Socket(const std::string& endpoint) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Socket() { close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  bool connected() const { return connected_; }
  bool send_now(const std::string& bytes, int flags = 0) {
    return send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | flags) >= 0;
  }
  // The handshake; libzmq refuses messages that come before it has answered.
  void greet() {
    std::string greeting(64, '\0');
    greeting[0] = '\xff';
    greeting[9] = '\x7f';
    greeting[10] = 3;
    greeting.replace(12, 4, "NULL");
    const std::string body =
        "\5READY" + std::string("\x0bSocket-Type") + std::string("\0\0\0\6", 4) + "DEALER";
    send_now(greeting + '\4' + static_cast<char>(body.size()) + body);
    std::string answer;
    char bytes[256];
    while (answer.find("READY") == std::string::npos) {
      const auto got = recv(fd_, bytes, sizeof bytes, 0);
      if (got <= 0) return;
      answer.append(bytes, static_cast<std::size_t>(got));
    }
  }
  // Reads what comes until the daemon closes; false after 10 s.
  bool sees_the_end() const {
    const timeval limit{10, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    char bytes[4096];
    while (true) {
      const auto got = recv(fd_, bytes, sizeof bytes, 0);
      if (got == 0 || (got < 0 && errno == ECONNRESET)) return true;
      if (got < 0) return false;
    }
  }

 private:
  int fd_;
  bool connected_ = false;
};

std::string repeated(const std::string& frame, int times) {
  std::string bytes;
  for (int i = 0; i < times; ++i) bytes += frame;
  return bytes;
}

std::string flood_head(std::uint64_t size) {
  std::string bytes("\2", 1);
  for (int shift = 56; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(size >> shift));
  return bytes;
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
    EXPECT_TRUE(!kMemoryTells || grown < kMostMib) << what;
  }
};

TEST_F(Flood, EndlessPartsOfOneMessageEndTheConnection) {
  serve(with_model());
  served_within_two_seconds();
  const std::string parts = repeated(std::string("\1\0", 2), 500'000);
  const double idle = resident_mib();
  for (int i = 0; i < 20; ++i) {
    Socket peer(endpoint_);
    peer.greet();
    peer.send_now(parts);  // may end early
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
  const std::string most = flood_head(16u << 20) + std::string(15u << 20, 'x');
  const double idle = resident_mib();
  std::vector<std::unique_ptr<Socket>> peers;
  for (int i = 0; i < 32; ++i) {
    peers.push_back(std::make_unique<Socket>(endpoint_));
    peers.back()->greet();
    peers.back()->send_now(most);
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
  Socket peer(endpoint_);
  peer.greet();
  peer.send_now(flood_head(1000) + "begun");
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
  std::vector<std::unique_ptr<Socket>> silent;
  for (int i = 0; i < 100; ++i) silent.push_back(std::make_unique<Socket>(endpoint_));
  served_within_two_seconds();
  EXPECT_TRUE(known.is_served());
  EXPECT_GE(router_->guard_counts().closed_for_room, 80u);
}

TEST_F(Flood, ThirtyTwoPeersWithABadByteEachLockNobodyOut) {
  serve(with_model());
  std::vector<std::unique_ptr<Socket>> bad;
  for (int i = 0; i < 32; ++i) {
    bad.push_back(std::make_unique<Socket>(endpoint_));
    bad.back()->send_now("x");
  }
  for (int i = 0; i < 32; ++i) {
    bad.push_back(std::make_unique<Socket>(endpoint_));
    bad.back()->greet();
    bad.back()->send_now(std::string("\0\1x", 3));  // a message of one byte
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

TEST_F(Flood, LargeMessagesOfAGoodClientArePassedOnWhole) {
  serve(with_model());
  RawPeer peer(endpoint_);
  for (int i = 0; i < 20; ++i) {
    const Received reply = peer.ask(MessageType::kStatusRequest, std::string(10u << 20, 'x'), 3);
    EXPECT_EQ(reply.request_id, 3u);
    EXPECT_EQ(error_of(reply).code, ErrorCode::kProtocol) << "a status request is empty";
  }
  EXPECT_EQ(router_->guard_counts().closed_for_memory, 0u);
}

}  // namespace
}  // namespace brainshift::server
