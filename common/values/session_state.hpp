// SPDX-License-Identifier: Apache-2.0
// Which session a message belongs to, what of every field a viewer wants, and what it may believe
// of the field that it shows.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

// Tells one session from every other, of this and of any daemon.
struct SessionKey {
  std::uint64_t boot_id = 0;     // of the daemon's process: random; 0: not stated
  std::uint64_t session_id = 0;  // counts up in one daemon, from 1; 0: none is running
  std::string model_id;          // hash of the loaded model; empty without one

  bool operator==(const SessionKey&) const = default;
};

enum class SessionPhase {
  kEmpty,      // no session
  kPreparing,  // the first one is being prepared
  kReady,      // no observation has been answered yet
  kTracking,   // the newest observation gave a usable field
  kDegraded,   // the newest observation gave none; the field before it stays
  kClosed,     // the daemon is stopping
};
std::string_view to_string(SessionPhase phase);  // "empty", "preparing", ...

// What is on the daemon's disk of a source: its observations above lost_until, up to until.
struct RecordedSource {
  std::string source;
  std::uint64_t until = 0;
  std::uint64_t lost_until = 0;  // the newest that no file holds; 0: none is lost

  bool operator==(const RecordedSource&) const = default;
};

struct RecordingState {
  bool recording = false;  // what is accepted now will be written
  std::string reason;      // why not; one sentence, else empty
  std::vector<RecordedSource> sources;

  // Whether an accepted observation is written and synced.
  bool holds(std::string_view source, std::uint64_t sequence) const;
  bool operator==(const RecordingState&) const = default;
};

// How old the data of a field are.
enum class FieldAge { kFresh, kAged, kExpired };

// What holds at the moment when the daemon sends it. A viewer may show a field as current for
// valid_ms after it SENT the request that this answers, as long as `session` is the field's and
// newest_usable its number: however long the answer was on its way, it makes no field look younger.
struct SessionState {
  // No answer holds for longer: a daemon that says more is refused.
  static constexpr std::uint32_t kMaxValidity_ms = 10'000;

  SessionKey session;
  SessionPhase phase = SessionPhase::kEmpty;
  std::uint64_t newest_update = 0;  // number of the newest final update, failures too; 0: none
  std::uint64_t newest_usable = 0;  // of the newest one with a usable field; 0: none
  // Since the observation that newest_usable answers was acquired, on the daemon's clock, sleep
  // included; since it arrived when the session is recorded.
  double age_ms = 0.0;
  std::uint32_t valid_ms = 0;
  std::string reason;      // why it is degraded; one sentence, else empty
  bool preparing = false;  // another session is being prepared; this one goes on until then
  std::optional<RecordingState> recording;  // empty: the daemon keeps no journal
  // Above the first a field is aged, above the second it has expired and must not be shown; 0: no
  // limit.
  std::uint32_t aged_after_ms = 0;
  std::uint32_t expired_after_ms = 0;
  bool recorded = false;  // a recording is played: no field of it is live
  std::string method;     // of the session; empty without one
  std::string boundary;   // of the session; empty without one

  // Of a field whose data are so old; not known (NaN): fresh.
  FieldAge age_of(double at_ms) const;
  // Why a field of that age is not current: "its data are 35.0 s old: 30 s at most"; empty when
  // fresh.
  std::string age_reason(double at_ms) const;
  // "condensed, contact", with "RECORDED, " in front; empty without a session.
  std::string kind() const;
  bool operator==(const SessionState&) const = default;
};

// ---------- what of every field ----------
//
// Choices combine: the nodes of a region, thinned to a spacing, and of these only the ones that
// changed by more than a tolerance since what the viewer holds. Regions are in the undeformed
// brain, so that the nodes of a choice stay the same for as long as the model does.

struct WholeBrain {
  bool operator==(const WholeBrain&) const = default;
};

// Nodes whose undeformed place lies in the ball. Patient RAS, mm.
struct BallRegion {
  Vec3 centre_mm = Vec3::Zero();
  double radius_mm = 0.0;

  bool operator==(const BallRegion& other) const {
    return (centre_mm.array() == other.centre_mm.array()).all() && radius_mm == other.radius_mm;
  }
};

// Nodes inside the undeformed tumour, or within the margin of its surface.
struct TumourRegion {
  double margin_mm = 0.0;

  bool operator==(const TumourRegion&) const = default;
};

using Region = std::variant<WholeBrain, BallRegion, TumourRegion>;

struct FieldChoice {
  // Largest coordinate, radius, margin and spacing: several heads.
  static constexpr double kMaxLength_mm = 1000.0;
  // Twice what the verdict on a field allows any node to move.
  static constexpr double kMaxTolerance_mm = 100.0;

  Region region = WholeBrain{};
  // 0: every node of the region. Otherwise nodes that are at least this far apart, chosen so that
  // every node of the region has one of them nearer than this; every boundary node a boundary node.
  double spacing_mm = 0.0;
  // 0: every chosen node of every update. Otherwise a node travels again when its displacement, or
  // its standard deviation, differs by more than this from what the viewer holds, or what is known
  // of it by more than 0.05.
  double tolerance_mm = 0.0;
  // Estimate::sd_mm and Estimate::known: three tenths of a field's bytes.
  bool with_sd = true;

  bool operator==(const FieldChoice&) const = default;
};

// kInvalidArgument or kNotFinite; the sentence names the length, its value and what it must be.
Status validate(const FieldChoice& choice);

// A choice on one mesh.
struct Selection {
  FieldChoice choice;
  int mesh_nodes = 0;            // of the whole mesh
  std::vector<NodeIndex> nodes;  // chosen, ascending, at least one

  bool every_node() const { return static_cast<int>(nodes.size()) == mesh_nodes; }
};
using SelectionPtr = std::shared_ptr<const Selection>;  // null: every node of every update

// What a viewer asks for when it subscribes, and every time that it renews its subscription.
struct Subscription {
  static constexpr std::uint32_t kMaxWindow = 256;

  std::uint64_t id = 0;        // chosen by the viewer; another number begins anew
  std::uint32_t window = 1;    // updates that may be under way to it at once; 1: the newest only
  std::uint64_t received = 0;  // updates received under this id
  FieldChoice choice = {};     // what of every field; another choice begins anew too

  bool operator==(const Subscription&) const = default;
};

}  // namespace brainshift
