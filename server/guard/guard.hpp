// SPDX-License-Identifier: GPL-3.0-or-later
// Guard: the daemon's door. It accepts connections, follows what each peer sends (ZmtpStream), and
// passes the bytes on to libzmq's socket, which listens inside the process alone:
//
//   peer <-> Guard <-> abstract socket <-> ROUTER
//
// libzmq keeps a message until its last part has come and counts messages, not bytes or parts. The
// guard bounds what it can be made to keep:
//
//   a message       max_message_bytes and 1024 parts; beyond that the connection is closed
//   a connection    is not read while libzmq holds more of it than one message and a MiB, or more
//                   than 8 messages (with CURVE 64 parts); closed when nothing of it was delivered
//                   for `patience`
//   all of them     held_bytes; beyond that the one whose bytes have waited longest is closed
//   connections     max_connections; the oldest that was never served makes room once it is 100 ms
//                   old, or nobody is accepted until one leaves
//
// What libzmq holds is the cost of what was passed on (ZmtpStream::cost) less what delivered() says
// the daemon has taken. With CURVE the parts of a message cannot be told from messages, and
// heartbeats not from parts: kForgiven bytes a second are forgiven.
//
// libzmq itself must never stop reading: once it has, a connection that is closed and a heartbeat
// in its buffer abort the process (_io_error, libzmq issue 4841). So its receive queue has no limit
// (router_socket.cpp), and the bounds above are the only ones.
//
// Without CURVE a routing id that another connection has is refused: its connection is closed. With
// CURVE libzmq ignores such a peer, and it is closed when its patience ends.
//
// Memory that is not to be had for a connection ends that connection.
//
// One thread of its own. delivered(), served() and close() are for the daemon's transport thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "common/core/error.hpp"
#include "server/guard/listener.hpp"

namespace brainshift::server {

struct GuardOptions {
  std::size_t max_message_bytes = 16u << 20;
  std::size_t held_bytes = 48u << 20;  // taken as two messages when that is more
  int max_connections = 256;
  std::chrono::milliseconds patience{30000};
};

struct GuardCounts {
  std::uint64_t accepted = 0;
  std::uint64_t closed_for_breach = 0;   // no ZMTP, too large, too many parts, a routing id twice
  std::uint64_t closed_for_memory = 0;   // held_bytes were used up
  std::uint64_t closed_for_silence = 0;  // nothing was delivered for `patience`
  std::uint64_t closed_for_room = 0;     // never served, when the last place was needed
};

class Guard {
 public:
  // inner: the name of the abstract socket where libzmq listens. Throws std::system_error.
  Guard(Listener listener, std::string inner, const GuardOptions& options);
  ~Guard();
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

  const std::string& endpoint() const;

  // inner_fd: libzmq's descriptor of the connection (ZMQ_SRCFD). Unknown ones are ignored.
  // The daemon has taken a message of so many bytes in so many parts.
  void delivered(int inner_fd, std::size_t bytes, std::size_t parts);
  // The peer is one that the daemon knows: its connection makes room for nobody.
  void served(int inner_fd);
  void close(int inner_fd);

  GuardCounts counts() const;
  // What libzmq holds, by the guard's account.
  std::uint64_t held_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::server
