// SPDX-License-Identifier: Apache-2.0
// FieldAssembly: makes the whole choice of an update that carries only what changed. Private to
// client/lib. Not thread-safe.
//
// Changes are applied to the usable update that they name as their base, of the same session, or
// not at all: what is held is never put together from two sessions or from an unusable field.
// Changes that arrive after a base was lost are dropped until the whole choice comes again, which
// the daemon sends first under a new subscription number.
#pragma once

#include <cstdint>
#include <optional>

#include "common/values/estimate.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

class FieldAssembly {
 public:
  enum class Outcome {
    kWhole,    // the message holds every node of the choice, and no base
    kLost,     // changes to an update that is not held: ask anew
    kDropped,  // the same, and asking anew was due before
  };

  // The viewer's choice from now on; forgets what is held. Without a tolerance nothing is held.
  void begin(const FieldChoice& choice);
  // What is held no longer counts: the next changes are dropped until the whole choice comes.
  void forget();
  Outcome complete(UpdateMessage& message);

 private:
  struct Held {
    SessionKey session;
    std::uint64_t sequence = 0;
    std::optional<FieldPart> part;
    Points displacement;
    VecX sd_mm;
  };
  // Puts the message's nodes into what is held; false when they do not fit it.
  bool apply(const UpdateMessage& message);

  bool holds_ = false;  // the choice has a tolerance
  bool waiting_ = false;
  std::optional<Held> held_;
};

}  // namespace brainshift::client
