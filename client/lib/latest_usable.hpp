// SPDX-License-Identifier: Apache-2.0
// The newest update whose field may be shown. Private to client/lib. Not thread-safe.
#pragma once

#include <optional>

#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// Iterates, failures and unusable fields pass it by: they never replace a usable field. A field of
// another session is somebody else's picture: a new session forgets it, and an older one, or one of
// another daemon, such as a snapshot that was still on its way, does not bring it back.
class LatestUsable {
 public:
  // This client's session is now this one; forgets the field of any earlier one.
  void begin(const SessionKey& session);
  // The daemon says that it runs this session: begins it unless it has begun already.
  void follow(const SessionKey& session);
  // Whether an update of this session is one of the running session, or of the next that its daemon
  // began. Before the first session: any.
  bool belongs(const SessionKey& session) const;
  void take(const UpdateMessage& message);
  const std::optional<UpdateMessage>& get() const { return latest_; }
  const SessionKey& session() const { return session_; }

 private:
  SessionKey session_;
  std::optional<UpdateMessage> latest_;
};

}  // namespace brainshift::client
