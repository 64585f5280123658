// SPDX-License-Identifier: Apache-2.0
#include "client/lib/latest_usable.hpp"

namespace brainshift::client {

void LatestUsable::begin(const SessionKey& session) {
  session_ = session;
  latest_.reset();
}

void LatestUsable::follow(const SessionKey& session) {
  if (session != session_) begin(session);
}

bool LatestUsable::belongs(const SessionKey& session) const {
  if (session_ == SessionKey{} || session == session_) return true;
  return session.boot_id == session_.boot_id && session.session_id > session_.session_id;
}

void LatestUsable::take(const UpdateMessage& message) {
  if (!belongs(message.key())) return;
  follow(message.key());
  if (message.error || !message.update.usable()) return;
  latest_ = message;
}

}  // namespace brainshift::client
