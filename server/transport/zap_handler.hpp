// SPDX-License-Identifier: GPL-3.0-or-later
// ZapHandler: answers libzmq's question whether a peer's key is known (ZeroMQ RFC 27). It runs on a
// thread of its own and must exist, in the socket's context, before the socket is bound: without a
// handler CURVE encrypts and admits everybody.
//
// A known key is admitted under its name, which libzmq gives every message of the connection as its
// property "User-Id". Any other is refused in the handshake, and counted.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <zmq.hpp>

#include "server/security/gate.hpp"

namespace brainshift::server {

class ZapHandler {
 public:
  // Throws zmq::error_t when the context has a handler already, and std::system_error.
  ZapHandler(zmq::context_t& context, KeyNames names);
  ~ZapHandler();
  ZapHandler(const ZapHandler&) = delete;
  ZapHandler& operator=(const ZapHandler&) = delete;

  std::uint64_t refused() const { return refused_; }  // handshakes

 private:
  void work();
  void answer();

  const KeyNames names_;
  zmq::socket_t socket_;
  int stop_fd_ = -1;
  std::atomic<std::uint64_t> refused_{0};
  std::thread thread_;
};

}  // namespace brainshift::server
