// SPDX-License-Identifier: Apache-2.0
#include "client/lib/latest_usable.hpp"

namespace brainshift::client {

void LatestUsable::begin(std::uint64_t session_id) {
  session_id_ = session_id;
  latest_.reset();
}

void LatestUsable::follow(std::uint64_t session_id) {
  if (session_id != session_id_) begin(session_id);
}

void LatestUsable::take(const wire::UpdateMessage& message) {
  if (message.session_id < session_id_) return;
  follow(message.session_id);
  if (message.error || !message.update.usable()) return;
  latest_ = message;
}

}  // namespace brainshift::client
