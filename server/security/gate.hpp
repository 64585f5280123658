// SPDX-License-Identifier: GPL-3.0-or-later
// Gate: whether a peer may ask what it asks, by the role of its key, and how often.
//
//   request                            least role
//   status, report, model, subscribe   viewer
//   observation                        source
//   start of a session                 owner
//   the same with takeover             admin
//   anything else                      admin
//
// Limits count per key, over all of its connections. Without keys every connection is a caller of
// its own, with the role admin. A refusal says why, is counted, and leaves the connection alone.
// Belongs to the transport thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/core/error.hpp"
#include "common/io/config/role.hpp"
#include "common/wire/frame.hpp"
#include "server/guard/token_bucket.hpp"

namespace brainshift::server {

// Names by public key (Z85).
using KeyNames = std::map<std::string, std::string>;

// With what the daemon proves who it is, and whom it knows.
struct ServerKeys {
  std::string secret_key;             // the daemon's, Z85
  KeyNames names;                     // of the clients, by public key
  std::map<std::string, Role> roles;  // of the clients, by name
};

// Per key; without keys, per connection. Observations: six times five sources of 60 Hz, for replays
// at full speed; one second of them may come at once. Starts: more than an operator can want, less
// than fills a disk.
struct Limits {
  int connections = 8;  // at once; of keys only
  int observations_per_s = 2000;
  int session_starts_per_min = 60;
};

struct Refusals {
  std::uint64_t not_allowed = 0;     // beyond the role
  std::uint64_t connections = 0;     // too many of one key
  std::uint64_t observations = 0;    // too many a second
  std::uint64_t session_starts = 0;  // too many a minute
};

// Roles by key name; nullopt: authentication is off.
using Roles = std::optional<std::map<std::string, Role>>;

class Gate {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  Gate(Roles roles, Limits limits) : roles_(std::move(roles)), limits_(limits) {}

  // caller: under which name a message counts, that of the key, or of the connection without keys.
  // Whether a caller that has `connections` may have one more. kUnavailable.
  Status enter(const std::string& caller, std::size_t connections);
  // Whether the caller may make this request, now. kNotAllowed; kUnavailable beyond a limit.
  Status admit(const std::string& caller, const wire::Frame& request, TimePoint now);
  // A caller's last connection has closed. What a key has used up stays used up.
  void left(const std::string& caller);

  const Refusals& refusals() const { return refusals_; }

 private:
  struct Allowance {
    Allowance(const Limits& limits, TimePoint now)
        : observations(limits.observations_per_s, limits.observations_per_s, now),
          session_starts(limits.session_starts_per_min / 60.0, limits.session_starts_per_min, now) {
    }
    TokenBucket observations, session_starts;
  };

  tl::unexpected<Error> refuse(std::uint64_t& counter, ErrorCode code, const std::string& sentence);

  Roles roles_;
  Limits limits_;
  std::map<std::string, Allowance> allowances_;  // by caller
  Refusals refusals_;
};

}  // namespace brainshift::server
