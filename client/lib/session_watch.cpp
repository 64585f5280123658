// SPDX-License-Identifier: Apache-2.0
#include "client/lib/session_watch.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

namespace brainshift::client {
namespace {

double seconds(BootClock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

std::string one_decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

}  // namespace

std::string_view to_string(Currency currency) {
  static constexpr std::string_view kNames[] = {"none",  "current", "superseded", "degraded",
                                                "stale", "aged",    "expired"};
  return enum_name<Currency::kExpired>(currency, kNames);
}

void SessionWatch::asked(std::uint64_t request_id, TimePoint now) {
  if (asked_.size() == kMaxAsked) asked_.pop_front();
  asked_.emplace_back(request_id, now);
}

void SessionWatch::answered(std::uint64_t request_id, const SessionState& state) {
  const auto request = std::find_if(asked_.begin(), asked_.end(),
                                    [&](const auto& entry) { return entry.first == request_id; });
  if (request == asked_.end()) return;
  as_of_ = request->second;
  state_ = state;
  asked_.erase(asked_.begin(), request + 1);  // answers come in the order of their requests
}

bool SessionWatch::refused(std::uint64_t request_id) {
  return std::erase_if(asked_, [&](const auto& entry) { return entry.first == request_id; }) > 0;
}

bool SessionWatch::model_fits(const std::string& model_id) const {
  return model_id_.empty() || model_id == model_id_;
}

bool SessionWatch::holds(TimePoint now) const {
  return as_of_ && state_ && now - *as_of_ < std::chrono::milliseconds(state_->valid_ms);
}

FieldStatus SessionWatch::judge(const std::optional<std::pair<SessionKey, std::uint64_t>>& shown,
                                const std::string& endpoint, TimePoint now,
                                double own_age_s) const {
  FieldStatus status = currency_of(shown, endpoint, now, own_age_s);
  status.recorded = state_ && state_->recorded;
  return status;
}

FieldStatus SessionWatch::currency_of(
    const std::optional<std::pair<SessionKey, std::uint64_t>>& shown, const std::string& endpoint,
    TimePoint now, double own_age_s) const {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (!state_ || !as_of_) return {Currency::kStale, "not subscribed to " + endpoint, kUnknown};
  const SessionState& state = *state_;
  if (!model_fits(state.session.model_id)) {
    return {Currency::kNone,
            endpoint + " serves model " + state.session.model_id + ", this viewer has loaded " +
                model_id_ + ": load the model anew",
            kUnknown};
  }
  if (!shown || shown->first != state.session) {
    return {
        Currency::kNone,
        "no usable field of the running session yet (" + std::string(to_string(state.phase)) + ")",
        kUnknown};
  }
  const double silent_s = seconds(now - *as_of_);
  const bool newest = shown->second == state.newest_usable;
  double age_s = newest ? 1e-3 * state.age_ms + silent_s : kUnknown;
  if (shown->second > state.newest_usable) age_s = own_age_s;
  if (!holds(now)) {
    return {Currency::kStale, "no word from " + endpoint + " for " + one_decimal(silent_s) + " s",
            age_s};
  }
  if (shown->second < state.newest_usable) {
    return {Currency::kSuperseded, "a newer field is on its way", age_s};
  }
  const FieldAge age = state.age_of(1e3 * age_s);
  const std::string too_old = state.age_reason(1e3 * age_s);
  if (age == FieldAge::kExpired) return {Currency::kExpired, too_old, age_s};
  if (state.newest_update > shown->second) return {Currency::kDegraded, state.reason, age_s};
  return {age == FieldAge::kAged ? Currency::kAged : Currency::kCurrent, too_old, age_s};
}

}  // namespace brainshift::client
