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
#include <vector>
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

// Which connections of a socket have closed, by the daemon's file descriptor of each. ROUTER
// sockets forget a peer silently; without this a daemon would keep subscribers that are gone.
//
// libzmq reports a close before it can deliver a message of a later connection that reuses the
// descriptor, so draining the monitor before each message is handled never takes a new peer for an
// old one.
class ConnectionMonitor {
 public:
  // watched: outlives this.
  ConnectionMonitor(zmq::context_t& context, zmq::socket_t& watched);
  // Watching ends first: libzmq loses the memory of an event that it reports after the receiver has
  // closed.
  ~ConnectionMonitor() { zmq_socket_monitor(watched_.handle(), nullptr, 0); }
  ConnectionMonitor(const ConnectionMonitor&) = delete;
  ConnectionMonitor& operator=(const ConnectionMonitor&) = delete;

  zmq::socket_t& socket() { return receiver_; }
  // Descriptors of the connections closed since the last call, oldest first.
  std::vector<int> closed();

 private:
  zmq::socket_t& watched_;
  zmq::socket_t receiver_;
};

}  // namespace brainshift::server
