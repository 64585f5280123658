// SPDX-License-Identifier: Apache-2.0
// What a viewer knows of the daemon's session, and for how long. Private to client/lib. Not
// thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "client/lib/field_status.hpp"
#include "common/core/stopwatch.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::client {

class SessionWatch {
 public:
  // Of a clock that runs while the computer sleeps: an answer does not hold any longer then.
  using TimePoint = BootClock::time_point;

  // A request for the state goes out: what its answer says holds from here.
  void asked(std::uint64_t request_id, TimePoint now);
  // The answer to that request; nothing is proven when the request is not known.
  void answered(std::uint64_t request_id, const SessionState& state);
  // The daemon refused that request, of which nothing more will come; true when it is known.
  bool refused(std::uint64_t request_id);
  // A state that nobody asked for: news, but no proof of time.
  void told(const SessionState& state) { state_ = state; }
  // The connection is gone; requests that are under way get no answer.
  void lost() { asked_.clear(); }

  // The model that this viewer draws with: fields of another one are none of its business.
  void expect_model(std::string model_id) { model_id_ = std::move(model_id); }
  // True for that model, and for any before one was named.
  bool model_fits(const std::string& model_id) const;

  // Last heard, by an answer or otherwise; empty before the first time.
  const std::optional<SessionState>& state() const { return state_; }
  // When the request was sent that was answered last; empty before the first time.
  const std::optional<TimePoint>& as_of() const { return as_of_; }
  // What the state says still holds.
  bool holds(TimePoint now) const;
  // Whether a field may be shown as current. shown: session and number of the newest usable field
  // that the viewer has; empty: it has none.
  // own_age_s: of that field, as its update says; NaN: not known. It counts as long as the daemon
  // has not been heard since that update.
  FieldStatus judge(const std::optional<std::pair<SessionKey, std::uint64_t>>& shown,
                    const std::string& endpoint, TimePoint now,
                    double own_age_s = std::numeric_limits<double>::quiet_NaN()) const;

 private:
  // judge(), but for `recorded`.
  FieldStatus currency_of(const std::optional<std::pair<SessionKey, std::uint64_t>>& shown,
                          const std::string& endpoint, TimePoint now, double own_age_s) const;

  static constexpr std::size_t kMaxAsked = 64;

  std::string model_id_;
  std::deque<std::pair<std::uint64_t, TimePoint>> asked_;  // oldest first
  std::optional<SessionState> state_;
  std::optional<TimePoint> as_of_;  // when the answered request was sent
};

}  // namespace brainshift::client
