// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/peers.hpp"

#include <algorithm>
#include <utility>

namespace brainshift::server {

bool Viewer::renew(const Subscription& subscription, SelectionPtr selection) {
  const bool anew =
      !begun_ || subscription.id != subscription_.id || subscription.choice != subscription_.choice;
  if (anew) {
    sent_ = 0;
    held_.reset();
    owe_nothing();
  }
  selection_ = std::move(selection);
  begun_ = true;
  const std::uint64_t acknowledged = anew ? 0 : subscription_.received;
  subscription_ = subscription;
  // A peer cannot take back what it has received, nor have received what was not sent.
  subscription_.received = std::clamp(subscription.received, acknowledged, sent_);
  return anew;
}

void Viewer::owe_usable(Bytes bytes) {
  usable_ = std::move(bytes);
  failure_.reset();
}

void Viewer::owe_nothing() {
  usable_.reset();
  failure_.reset();
}

Bytes Viewer::next() const {
  if (under_way() >= subscription_.window) return {};
  return usable_ ? usable_ : failure_;
}

void Viewer::sent() {
  ++sent_;
  (usable_ ? usable_ : failure_).reset();
}

bool Viewer::may_iterate() const {
  const std::uint64_t spare = std::max<std::uint64_t>(1, subscription_.window - 1);
  return !usable_ && !failure_ && under_way() < spare;
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
