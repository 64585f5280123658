// SPDX-License-Identifier: Apache-2.0
#include "client/lib/update_queue.hpp"

#include <algorithm>
#include <utility>

namespace brainshift::client {

void UpdateQueue::push(Result<UpdateMessage> update) {
  updates_.push_back(std::move(update));
  if (updates_.size() <= capacity_) return;
  const auto iterate = std::find_if(updates_.begin(), updates_.end(), [](const auto& entry) {
    return entry && !entry->error && !entry->update.final;
  });
  if (iterate != updates_.end()) updates_.erase(iterate);
}

void UpdateQueue::drop_older_than(const SessionState& state) {
  std::erase_if(updates_, [&](const Result<UpdateMessage>& entry) {
    if (!entry) return false;
    if (entry->key() != state.session) return true;
    const bool usable = !entry->error && entry->update.usable();
    return entry->update.sequence < (usable ? state.newest_usable : state.newest_update);
  });
}

std::optional<Result<UpdateMessage>> UpdateQueue::pop() {
  if (updates_.empty()) return std::nullopt;
  std::optional<Result<UpdateMessage>> front(std::move(updates_.front()));
  updates_.pop_front();
  return front;
}

}  // namespace brainshift::client
