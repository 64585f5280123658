// SPDX-License-Identifier: GPL-3.0-or-later
// Connection: a peer's socket, the one to libzmq that its bytes go to, and the account of what
// libzmq holds of it. Private to server/guard.
#pragma once

#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/guard/token_bucket.hpp"
#include "server/guard/zmtp_stream.hpp"

namespace brainshift::server {

// Bytes on their way in one direction, from one socket that does not block to another.
struct Lane {
  static constexpr std::size_t kBytes = 16u << 10;

  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(kBytes);
  std::size_t begin = 0, end = 0;
  bool empty() const { return begin == end; }
};

// Headers and encryption of a part: at most this was counted for it beside ZmtpStream::kPartCost.
inline constexpr std::size_t kWrapping = 48;

// What the guard and the transport thread both know of a connection.
struct Account {
  std::atomic<std::uint64_t> delivered{0};
  std::atomic<std::uint64_t> messages{0};
  std::atomic<std::uint64_t> parts{0};
  std::atomic<bool> served{false};
  std::atomic<bool> to_close{false};
  std::atomic<bool> throttled{false};  // it is not read for now
};

// Bytes a second that a connection is read at, and at once: of the largest observations thirty, and
// two.
inline constexpr double kBytesPerSecond = 64.0 * (1u << 20), kBytesAtOnce = 4.0 * (1u << 20);

struct Connection {
  using TimePoint = std::chrono::steady_clock::time_point;

  Connection(const ZmtpStream::Bounds& bounds, TimePoint now)
      : stream(bounds),
        to_read(kBytesPerSecond, kBytesAtOnce, now),
        opened(now),
        forgiven(now),
        moved(now) {}
  ~Connection();  // closes both sockets
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Brings `held`, `waiting` and `moved` up to date. By how much `held` has changed, modulo 2^64.
  std::uint64_t settle(TimePoint now);
  // Something cannot go on at once.
  bool stuck() const { return !up.empty() || !down.empty() || account->throttled; }

  int peer = -1, inner = -1;
  std::string name;  // of the inner socket
  Lane up, down;     // to libzmq, to the peer
  ZmtpStream stream;
  TokenBucket to_read;  // bytes
  std::shared_ptr<Account> account = std::make_shared<Account>();
  std::uint64_t held = 0;     // by libzmq
  std::uint64_t waiting = 0;  // messages that libzmq holds whole; with CURVE parts
  TimePoint opened;
  TimePoint forgiven;
  TimePoint moved;  // something was delivered, or nothing was held

 private:
  // What was taken in so far: of the stream's cost and messages, and of the account.
  std::uint64_t cost_ = 0;
  std::uint64_t complete_ = 0;
  std::uint64_t delivered_ = 0;
  std::uint64_t messages_ = 0;
  std::uint64_t parts_ = 0;
  std::uint64_t forgiven_bytes_ = 0;  // not yet counted as parts
};

// The abstract name of a socket (getsockname) or of its peer (getpeername); empty: it has none.
std::string socket_name(int fd, decltype(&getsockname) ask);

// A connection to libzmq's socket, under a name of its own; -1 when there is none to be had.
int connect_inner(const std::string& inner);

}  // namespace brainshift::server
