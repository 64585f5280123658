// SPDX-License-Identifier: GPL-3.0-or-later
// Peers: who talks to the daemon now, and what each is still owed. Plain bookkeeping of the
// transport thread.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/delivery/viewer.hpp"

namespace brainshift::server {

struct Peer {
  std::string caller;            // under which it counts (server/security/gate.hpp)
  int connection_fd = -1;        // the daemon's descriptor of the connection, until it closes
  std::optional<Viewer> viewer;  // of a subscriber
  std::deque<Bytes> replies;     // that did not fit into the peer's queue, oldest first
  std::size_t reply_bytes = 0;   // of these
  static constexpr std::size_t kMaxReplies = 256;
  static constexpr std::size_t kMaxReplyBytes = 64u << 20;

  // Whether one more reply may wait; a peer that does not read loses it otherwise.
  bool may_wait(const Bytes& reply) const {
    return replies.empty() ||
           (replies.size() < kMaxReplies && reply_bytes + reply->size() <= kMaxReplyBytes);
  }
};

class Peers {
 public:
  explicit Peers(std::size_t max_peers) : max_peers_(max_peers) {}

  // The peer, added when it is new; null when max_peers others are connected.
  Peer* add(const std::string& routing_id, int connection_fd);
  Peer* find(const std::string& routing_id);
  std::size_t connections_of(const std::string& caller) const;
  void remove(const std::string& routing_id) { peers_.erase(routing_id); }
  // A connection closed: the peers removed (none or one).
  std::vector<std::string> remove_connection(int connection_fd);
  std::map<std::string, Peer>& all() { return peers_; }
  const std::map<std::string, Peer>& all() const { return peers_; }
  // Something that could go out now, if the peer's queue had room.
  bool anything_owed() const;

 private:
  std::size_t max_peers_;
  std::map<std::string, Peer> peers_;  // by routing id
};

}  // namespace brainshift::server
