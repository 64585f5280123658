// SPDX-License-Identifier: GPL-3.0-or-later
// Peers: who talks to the daemon now, who subscribed, and what each is still owed. Plain
// bookkeeping of the transport thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/values/session_state.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/parcels.hpp"

namespace brainshift::server {

// A subscriber's credit, what it is owed, and what it chose and holds of it.
class Viewer {
 public:
  // Renews the subscription; true when it is a new one, or has another choice: it then begins with
  // full credit, is owed nothing and holds nothing. selection: its choice on the loaded model.
  bool renew(const Subscription& subscription, SelectionPtr selection = nullptr);

  // From now on it is owed this usable field and nothing older.
  void owe_usable(Bytes bytes);
  // The newest observation that gave no usable field, beside the field before it.
  void owe_failure(Bytes bytes) { failure_ = std::move(bytes); }
  void owe_nothing();

  // What to send next; null when nothing is owed or its credit is used up.
  Bytes next() const;
  // next() has gone out.
  void sent();
  // Whether an iterate may go out: nothing is owed, and a final update will still find credit.
  bool may_iterate() const;
  void iterate_sent() { ++sent_; }

  const SelectionPtr& selection() const { return selection_; }  // null: every node of every update
  // What it holds when everything sent has arrived; null: nothing, or its choice has no tolerance.
  const Held& held() const { return held_; }
  void hold(Held held) { held_ = std::move(held); }
  const Subscription& subscription() const { return subscription_; }
  std::uint64_t updates_sent() const { return sent_; }  // in this subscription
  // Updates that wait for its credit.
  int owed() const { return (usable_ ? 1 : 0) + (failure_ ? 1 : 0); }

 private:
  std::uint64_t under_way() const { return sent_ - subscription_.received; }

  Subscription subscription_;
  bool begun_ = false;
  std::uint64_t sent_ = 0;  // updates in this subscription
  Bytes usable_;
  Bytes failure_;
  SelectionPtr selection_;
  Held held_;
};

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
  Peer* admit(const std::string& routing_id, int connection_fd);
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
