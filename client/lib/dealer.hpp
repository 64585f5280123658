// SPDX-License-Identifier: Apache-2.0
// A ZeroMQ DEALER socket that sends and receives single-part messages before a deadline.
// Private to client/lib; knows nothing of what the bytes mean.
//
// The socket hands messages to completed connections only, so that a request to nobody fails
// instead of waiting in a queue. Heartbeats notice a peer that vanished without closing. receive()
// reports a lost connection at once, because the peer's answer is lost with it. The socket
// reconnects by itself. With keys it is encrypted, and talks to the holder of the daemon's key
// alone. Not thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/lib/client_keys.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

using Deadline = std::chrono::steady_clock::time_point;

class Dealer {
 public:
  // kInvalidArgument for an endpoint or a key that ZeroMQ does not understand. Does not wait for
  // the peer.
  static Result<std::unique_ptr<Dealer>> connect(const std::string& endpoint,
                                                 std::chrono::milliseconds heartbeat_interval,
                                                 const std::optional<ClientKeys>& keys = {});
  Dealer(const Dealer&) = delete;
  Dealer& operator=(const Dealer&) = delete;
  ~Dealer();

  // kUnavailable when no connection accepts the message before the deadline; the sentence says when
  // keys may be the reason.
  Status send(std::string_view message, Deadline deadline);
  // kUnavailable at the deadline or when the connection is lost; kProtocol for a multipart
  // message.
  Result<std::string> receive(Deadline deadline);

  // Something has arrived; receive() would not wait.
  bool readable() const;
  // Connections lost so far, whichever call noticed: what the peer knew of this client is gone
  // with each.
  std::uint64_t losses() const { return losses_; }

  const std::string& endpoint() const { return endpoint_; }

 private:
  Dealer() = default;
  Status set_keys(const ClientKeys& keys);
  std::string no_daemon() const;
  Status open_monitor();
  // Takes in what the monitor has to report. True when a connection was lost.
  bool read_monitor();
  Result<std::string> receive_waiting();

  std::string endpoint_;
  void* context_ = nullptr;
  void* socket_ = nullptr;
  void* monitor_ = nullptr;
  std::uint64_t losses_ = 0;
  bool keys_ = false;
  int handshake_failure_ = 0;  // number of the monitor's event since the last handshake; 0: none
  bool connected_ = false;  // a handshake, and no loss since, in the order of the monitor's reports
};

}  // namespace brainshift::client
