// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/viewer.hpp"

#include <algorithm>

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

void Viewer::sent(Held held) {
  if (held) held_ = std::move(held);
  ++sent_;
  (usable_ ? usable_ : failure_).reset();
}

bool Viewer::may_iterate() const {
  const std::uint64_t spare = std::max<std::uint64_t>(1, subscription_.window - 1);
  return !usable_ && !failure_ && under_way() < spare;
}

}  // namespace brainshift::server
