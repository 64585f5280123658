// SPDX-License-Identifier: Apache-2.0
// Which session a message belongs to, and what a viewer may believe of the field that it shows.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

// What holds at the moment when the daemon sends it. A viewer may show a field as current for
// valid_ms after it SENT the request that this answers, as long as `session` is the field's and
// newest_usable its number: however long the answer was on its way, it makes no field look younger.
struct SessionState {
  SessionKey session;
  SessionPhase phase = SessionPhase::kEmpty;
  std::uint64_t newest_update = 0;  // number of the newest final update, failures too; 0: none
  std::uint64_t newest_usable = 0;  // of the newest one with a usable field; 0: none
  double age_ms = 0.0;              // since the observation that newest_usable answers arrived
  std::uint32_t valid_ms = 0;
  std::string reason;      // why it is degraded; one sentence, else empty
  bool preparing = false;  // another session is being prepared; this one goes on until then
  std::optional<RecordingState> recording;  // empty: the daemon keeps no journal

  bool operator==(const SessionState&) const = default;
};

// What a viewer asks for when it subscribes, and every time that it renews its subscription.
struct Subscription {
  static constexpr std::uint32_t kMaxWindow = 256;

  std::uint64_t id = 0;        // chosen by the viewer; another number begins anew
  std::uint32_t window = 1;    // updates that may be under way to it at once; 1: the newest only
  std::uint64_t received = 0;  // updates received under this id

  bool operator==(const Subscription&) const = default;
};

}  // namespace brainshift
