// SPDX-License-Identifier: Apache-2.0
// The newest update whose field may be shown. Private to client/lib. Not thread-safe.
#pragma once

#include <cstdint>
#include <optional>

#include "common/wire/convert.hpp"

namespace brainshift::client {

// Iterates, failures and unusable fields pass it by: they never replace a usable field. A field of
// another session is somebody else's picture: a new session forgets it, and an older one, such as a
// snapshot that was still on its way, does not bring it back.
class LatestUsable {
 public:
  // This client's session is now this one; forgets the field of any earlier one.
  void begin(std::uint64_t session_id);
  // The daemon runs this session: begins it unless it has begun already.
  void follow(std::uint64_t session_id);
  void take(const wire::UpdateMessage& message);
  const std::optional<wire::UpdateMessage>& get() const { return latest_; }

 private:
  std::uint64_t session_id_ = 0;
  std::optional<wire::UpdateMessage> latest_;
};

}  // namespace brainshift::client
