// SPDX-License-Identifier: GPL-3.0-or-later
// Peers: who talks to the daemon now, who subscribed, and what a slow subscriber is still owed.
// Plain bookkeeping of the transport thread.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>

#include "server/transport/outbox.hpp"

namespace brainshift::server {

struct Peer {
  int connection_fd =
      -1;  // the daemon's descriptor of the peer's connection; names it until it closes
  bool subscribed = false;
  // Final updates and failures that did not fit into the peer's queue, oldest first.
  struct Owed {
    Bytes bytes;
    bool usable = false;  // a usable field (Delivery::kFinal)
  };
  std::deque<Owed> owed;
  static constexpr std::size_t kMaxOwed = 4;

  // Beyond kMaxOwed the oldest gives way, but never the newest usable field: it stays the valid one
  // however many failures follow.
  void owe(Bytes bytes, bool usable);
};

class Peers {
 public:
  explicit Peers(std::size_t max_peers) : max_peers_(max_peers) {}

  // The peer, added when it is new; null when max_peers others are connected.
  Peer* admit(const std::string& routing_id, int connection_fd);
  Peer* find(const std::string& routing_id);
  void remove(const std::string& routing_id) { peers_.erase(routing_id); }
  // A connection closed. Returns the number of peers removed (0 or 1).
  std::size_t remove_connection(int connection_fd);
  std::map<std::string, Peer>& all() { return peers_; }
  bool anything_owed() const;

 private:
  std::size_t max_peers_;
  std::map<std::string, Peer> peers_;  // by routing id
};

}  // namespace brainshift::server
