// SPDX-License-Identifier: GPL-3.0-or-later
// Upstream: the bridge as an OpenIGTLink client of PlusServer or 3D Slicer. Private to
// client/bridge.
//
// It connects, sends GET_STATUS of version 2, so that PlusServer answers with version 2 (it starts
// with version 1 for every client), and reads. It connects again by itself. Belongs to one thread.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "client/tools/bridge/peer.hpp"
#include "client/tools/bridge/socket.hpp"
#include "common/igtl/message.hpp"
#include "common/igtl/stream_reader.hpp"

namespace brainshift::client {

class Upstream {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  // Between two attempts.
  static constexpr std::chrono::milliseconds kRetry{500};

  Upstream(Address address, igtl::StreamLimits limits);

  // -1 while there is no connection under way.
  int descriptor() const { return socket_ ? socket_->descriptor() : -1; }
  bool connected() const { return connected_; }
  bool wants_to_write() const { return socket_ && (!connected_ || !unsent_.empty()); }

  // Begins to connect when it is time. A sentence when something is to be told.
  std::optional<std::string> tend(TimePoint now);
  // Goes on with the socket, which is ready.
  std::optional<std::string> ready(bool readable, bool writable, TimePoint now,
                                   const Peer::Sink& sink);

 private:
  std::optional<std::string> lost(const Error& error, TimePoint now);
  Status write();
  Status read(const Peer::Sink& sink);

  Address address_;
  igtl::StreamLimits limits_;
  std::optional<Socket> socket_;
  std::optional<igtl::StreamReader> reader_;
  bool connected_ = false;
  bool told_ = false;  // that there is no connection
  std::string unsent_;
  TimePoint next_attempt_{};
};

}  // namespace brainshift::client
