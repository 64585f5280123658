// SPDX-License-Identifier: GPL-3.0-or-later
// RouterSocket: libzmq's ROUTER socket as the router uses it. Frames in with what is known of their
// connection, frames out to one peer; nothing waits.
//
// It listens under a name that only this process can reach: its peer is the guard
// (server/guard/guard.hpp), which passes on the bytes of everybody else.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <zmq.hpp>

#include "server/transport/outbox.hpp"
#include "server/transport/router_options.hpp"

namespace brainshift::server {

struct Incoming {
  std::string peer;  // libzmq's routing id; a peer that comes back has another
  int connection_fd = -1;
  std::string user_id;     // the key's name; empty without keys
  zmq::message_t payload;  // the first part
  std::size_t parts = 0;
  std::size_t bytes = 0;  // of all parts
};

enum class Sent { kYes, kQueueFull, kPeerGone };

// The largest frame that the options admit, its header included.
std::size_t max_message_bytes(const RouterOptions& options);

// Every function throws zmq::error_t where libzmq refuses for another reason than those named.
class RouterSocket {
 public:
  // Set up as the options say, with CURVE when they hold keys; not bound yet, since a monitor
  // misses what comes before it.
  RouterSocket(zmq::context_t& context, const RouterOptions& options);

  // Listens; returns the abstract socket name that the guard connects to.
  std::string bind();
  // The next message; nothing when none is waiting.
  std::optional<Incoming> receive();
  // Shares the bytes with libzmq until they are sent.
  Sent send(const std::string& peer, const Bytes& bytes);
  zmq::socket_t& zmq() { return socket_; }

 private:
  zmq::socket_t socket_;
};

}  // namespace brainshift::server
