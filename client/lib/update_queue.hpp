// SPDX-License-Identifier: Apache-2.0
// Updates that arrived while a call waited for something else, in order of arrival.
// Private to client/lib. Not thread-safe.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "common/core/error.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// Holds `capacity` entries. When it is full, the oldest iterate gives way, because a newer one
// says more. Final updates and errors are never dropped: a queue of nothing else grows past its
// capacity.
class UpdateQueue {
 public:
  explicit UpdateQueue(std::size_t capacity) : capacity_(capacity) {}

  void push(Result<UpdateMessage> update);
  // The oldest entry; nullopt when there is none.
  std::optional<Result<UpdateMessage>> pop();
  std::size_t size() const { return updates_.size(); }
  // Drops what the daemon has newer: usable fields before newest_usable, everything else before
  // newest_update, and all of another session than the state's. Entries that are errors stay.
  void drop_older_than(const SessionState& state);

 private:
  std::size_t capacity_;
  std::deque<Result<UpdateMessage>> updates_;
};

}  // namespace brainshift::client
