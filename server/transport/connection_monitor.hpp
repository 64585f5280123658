// SPDX-License-Identifier: GPL-3.0-or-later
// ConnectionMonitor: which connections of a socket have closed, by the daemon's file descriptor of
// each. ROUTER sockets forget a peer silently; without this a daemon would keep subscribers that
// are gone.
//
// libzmq reports a close before it can deliver a message of a later connection that reuses the
// descriptor, so draining the monitor before each message is handled never takes a new peer for an
// old one.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>
#include <zmq.hpp>

namespace brainshift::server {

class ConnectionMonitor {
 public:
  // watched: outlives this.
  ConnectionMonitor(zmq::context_t& context, zmq::socket_t& watched)
      : watched_(watched), receiver_(context, zmq::socket_type::pair) {
    constexpr const char* kAddress = "inproc://brainshiftd-connections";
    if (zmq_socket_monitor(watched.handle(), kAddress, ZMQ_EVENT_DISCONNECTED) != 0) {
      throw zmq::error_t();
    }
    receiver_.set(zmq::sockopt::linger, 0);
    receiver_.connect(kAddress);
  }
  // Watching ends first: libzmq loses the memory of an event that it reports after the receiver has
  // closed.
  ~ConnectionMonitor() { zmq_socket_monitor(watched_.handle(), nullptr, 0); }
  ConnectionMonitor(const ConnectionMonitor&) = delete;
  ConnectionMonitor& operator=(const ConnectionMonitor&) = delete;

  zmq::socket_t& socket() { return receiver_; }

  // Descriptors of the connections closed since the last call, oldest first.
  std::vector<int> closed() {
    std::vector<int> descriptors;
    zmq::message_t event;
    while (receiver_.recv(event, zmq::recv_flags::dontwait)) {
      // An event is 16 bits of number and 32 bits of value, followed by a frame with the address.
      if (event.size() == sizeof(std::uint16_t) + sizeof(std::int32_t)) {
        std::int32_t descriptor = -1;
        std::memcpy(&descriptor, event.data<char>() + sizeof(std::uint16_t), sizeof descriptor);
        descriptors.push_back(descriptor);
      }
      zmq::message_t address;
      static_cast<void>(receiver_.recv(address, zmq::recv_flags::dontwait));
    }
    return descriptors;
  }

 private:
  zmq::socket_t& watched_;
  zmq::socket_t receiver_;
};

}  // namespace brainshift::server
