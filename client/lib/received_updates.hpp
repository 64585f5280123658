// SPDX-License-Identifier: Apache-2.0
// What a client keeps of the updates that it has received: those that wait for their caller, the
// field that changes are applied to, and the newest one whose field may be shown. Private to
// client/lib. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// kProtocol when the update's field is not one of a mesh of so many nodes; 0: it is not known.
Status check_mesh(const UpdateMessage& message, int mesh_nodes);

// Updates that arrived while a call waited for something else, in order of arrival.
//
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

// Makes the whole choice of an update that carries only what changed.
//
// Changes are applied to the usable update that they name as their base, of the same session, or
// not at all: what is held is never put together from two sessions or from an unusable field.
// Changes that arrive after a base was lost are dropped until the whole choice comes again, which
// the daemon sends first under a new subscription number.
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
    VecX sd_mm, known;
  };
  // Puts the message's nodes into what is held; false when they do not fit it.
  bool apply(const UpdateMessage& message);

  bool holds_ = false;  // the choice has a tolerance
  bool waiting_ = false;
  std::optional<Held> held_;
};

// The newest update whose field may be shown.
//
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
