// SPDX-License-Identifier: GPL-3.0-or-later
// A signal is no failure of a socket.
#pragma once

#include <zmq.hpp>

namespace brainshift::server {

// What `call` returns. libzmq looks at its commands before it does anything, and gives up with
// EINTR when a signal comes just then (zmq_msg_recv(3), zmq_msg_send(3)): it is called once more.
template <typename Call>
auto uninterrupted(const Call& call) {
  while (true) {
    try {
      return call();
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
  }
}

}  // namespace brainshift::server
