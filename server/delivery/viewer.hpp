// SPDX-License-Identifier: GPL-3.0-or-later
// Viewer: a subscriber's credit, what it is owed, and what it chose and holds of it. Plain
// bookkeeping of the transport thread.
#pragma once

#include <cstdint>
#include <utility>

#include "common/values/session_state.hpp"
#include "server/delivery/parcels.hpp"

namespace brainshift::server {

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
  // next() has gone out, and made it hold this; null: what it held before.
  void sent(Held held = nullptr);
  // Whether an iterate may go out: nothing is owed, and a final update will still find credit.
  bool may_iterate() const;
  void iterate_sent() { ++sent_; }

  const SelectionPtr& selection() const { return selection_; }  // null: every node of every update
  // What it holds when everything sent has arrived; null: nothing, or its choice has no tolerance.
  const Held& held() const { return held_; }
  const Subscription& subscription() const { return subscription_; }
  std::uint64_t updates_sent() const { return sent_; }  // in this subscription
  // Updates that wait for its credit.
  int owed() const { return (usable_ ? 1 : 0) + (failure_ ? 1 : 0); }

 private:
  std::uint64_t under_way() const { return sent_ - subscription_.received; }

  Subscription subscription_;
  bool begun_ = false;
  std::uint64_t sent_ = 0;  // updates in this subscription
  Bytes usable_, failure_;
  SelectionPtr selection_;
  Held held_;
};

}  // namespace brainshift::server
