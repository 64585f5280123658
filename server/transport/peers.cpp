// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/peers.hpp"

#include <algorithm>
#include <utility>

namespace brainshift::server {

void Peer::owe(Bytes bytes, bool usable) {
  owed.push_back({std::move(bytes), usable});
  if (owed.size() <= kMaxOwed) return;
  const bool only_usable =
      owed.front().usable &&
      std::none_of(owed.begin() + 1, owed.end(), [](const Owed& entry) { return entry.usable; });
  owed.erase(owed.begin() + (only_usable ? 1 : 0));
}

Peer* Peers::admit(const std::string& routing_id, int connection_fd) {
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

std::size_t Peers::remove_connection(int connection_fd) {
  return std::erase_if(
      peers_, [&](const auto& entry) { return entry.second.connection_fd == connection_fd; });
}

bool Peers::anything_owed() const {
  return std::any_of(peers_.begin(), peers_.end(),
                     [](const auto& entry) { return !entry.second.owed.empty(); });
}

}  // namespace brainshift::server
