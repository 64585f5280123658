// SPDX-License-Identifier: GPL-3.0-or-later
// Parcels: the bytes that a viewer who chose a part of every field gets of an update.
//
// Made when they are about to be sent, from the bytes that everybody else gets: the worker knows
// nothing of choices, and a viewer that is not sent anything costs nothing. Made once for all
// viewers with the same choice and, where a choice has a tolerance, the same held field.
//
// With a tolerance t, and u what the update says of a node, h what the viewer holds of it: the node
// travels when |u - h| > t, when the standard deviations differ by more than t, or what is known by
// more than kKnownTolerance. Both ends compute with the same 32-bit floats and bytes, so that what
// a viewer holds is known here exactly. The whole choice travels, and replaces what is held, when
// the viewer holds nothing of this session, when most of it changed, and when standard deviations,
// or what is known, come or go. An update that is not usable travels with the whole choice; nobody
// holds it.
//
// Plain bookkeeping of the transport thread, of which a turn makes at most kMakesPerTurn parcels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/values/session_state.hpp"
#include "common/wire/frame.hpp"
#include "common/wire/published_update.hpp"

namespace brainshift::server {

// A complete frame (common/wire/frame.hpp), shared by all to whom it goes.
using Bytes = std::shared_ptr<const std::string>;
Bytes framed(wire::MessageType type, std::uint64_t request_id, std::string_view payload);

// What a viewer holds once it has received what it was sent; of a choice with a tolerance.
struct HeldField {
  SessionKey session;
  std::uint64_t sequence = 0;  // of the update that brought it up to date
  std::vector<float> xyz_mm;   // 3 per node of the choice
  std::vector<float> sd_mm;    // one per node of the choice, or none
  std::string known;           // the same in bytes, 255: all
};
using Held = std::shared_ptr<const HeldField>;

struct Parcel {
  Bytes bytes;
  Held held;  // what the viewer holds from now on; null: what it held before
};

class Parcels {
 public:
  static constexpr int kMakesPerTurn = 8;
  static constexpr double kKnownTolerance = 0.05;
  // The newest usable update, the newest failure since and an iterate.
  static constexpr std::size_t kUpdatesKept = 3;
  // Of parcels that are kept for the next viewer of the same choice. Beyond that the oldest go:
  // they would be made once more.
  static constexpr std::size_t kBytesKept = 16u << 20;

  // Drops what was made for choices that no viewer has any more.
  void begin_turn();
  std::size_t bytes_kept() const;
  // Of a session that has ended nothing is kept.
  void forget_session() { entries_.clear(); }
  // Whether something was left to the next turn.
  bool spent() const { return made_ >= kMakesPerTurn; }

  // The parcel for one viewer. whole: the frame of an update with its whole field. held: null or
  // what the viewer holds. Empty: this turn has made its share. An update without a field, or of
  // another mesh than the selection's, travels as it is.
  std::optional<Parcel> make(const Bytes& whole, const SelectionPtr& selection, const Held& held);

 private:
  struct Made {
    std::weak_ptr<const Selection> selection;  // of the viewers that chose it
    Held base;
    Parcel parcel;
    std::size_t bytes() const;
  };
  struct Entry {
    Bytes whole;
    std::optional<wire::PublishedUpdate> update;  // empty: has no field
    std::deque<Made> made;                        // the newest last
  };
  Entry& entry(const Bytes& whole);

  std::deque<Entry> entries_;  // the newest last
  int made_ = 0;
};

}  // namespace brainshift::server
