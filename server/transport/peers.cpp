// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/peers.hpp"

#include <algorithm>

namespace brainshift::server {

Peer* Peers::add(const std::string& routing_id, int connection_fd) {
  if (Peer* known = find(routing_id)) {
    known->connection_fd = connection_fd;
    return known;
  }
  if (peers_.size() >= max_peers_) return nullptr;
  Peer& peer = peers_[routing_id];
  peer.connection_fd = connection_fd;
  return &peer;
}

Peer* Peers::find(const std::string& routing_id) {
  const auto found = peers_.find(routing_id);
  return found == peers_.end() ? nullptr : &found->second;
}

std::size_t Peers::connections_of(const std::string& caller) const {
  return static_cast<std::size_t>(
      std::count_if(peers_.begin(), peers_.end(),
                    [&](const auto& entry) { return entry.second.caller == caller; }));
}

std::vector<std::string> Peers::remove_connection(int connection_fd) {
  std::vector<std::string> removed;
  for (auto next = peers_.begin(); next != peers_.end();) {
    const auto peer = next++;
    if (peer->second.connection_fd != connection_fd) continue;
    removed.push_back(peer->first);
    peers_.erase(peer);
  }
  return removed;
}

bool Peers::anything_owed() const {
  return std::any_of(peers_.begin(), peers_.end(), [](const auto& entry) {
    const Peer& peer = entry.second;
    return !peer.replies.empty() || (peer.viewer && peer.viewer->next());
  });
}

}  // namespace brainshift::server
