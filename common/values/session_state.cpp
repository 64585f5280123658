// SPDX-License-Identifier: Apache-2.0
#include "common/values/session_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace brainshift {
namespace {

std::string text(double value) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%g", value);
  return digits;
}

// lowest < value <= highest, or lowest <= value when `inclusive`.
Status check_range(std::string_view name, double value, double lowest, bool inclusive,
                   double highest) {
  const std::string named = "choice." + std::string(name) + " = " + text(value);
  if (!std::isfinite(value)) return fail(ErrorCode::kNotFinite, named + ": must be a number");
  const bool above = inclusive ? value >= lowest : value > lowest;
  if (above && value <= highest) return {};
  std::string bound = inclusive ? "[" : "(";
  bound += text(lowest) + ", " + text(highest) + "]";
  return invalid(named + ": must be in " + bound);
}

Status validate(const Region& region) {
  constexpr double kMax = FieldChoice::kMaxLength_mm;
  if (const auto* tumour = std::get_if<TumourRegion>(&region)) {
    return check_range("tumour.margin_mm", tumour->margin_mm, 0.0, true, kMax);
  }
  const auto* ball = std::get_if<BallRegion>(&region);
  if (ball == nullptr) return {};
  for (const double coordinate : ball->centre_mm) {
    if (Status status = check_range("ball.centre_mm", coordinate, -kMax, true, kMax); !status) {
      return status;
    }
  }
  return check_range("ball.radius_mm", ball->radius_mm, 0.0, false, kMax);
}

}  // namespace

std::string_view to_string(SessionPhase phase) {
  static constexpr std::string_view kNames[] = {"empty",    "preparing", "ready",
                                                "tracking", "degraded",  "closed"};
  return enum_name<SessionPhase::kClosed>(phase, kNames);
}

FieldAge SessionState::age_of(double at_ms) const {
  if (expired_after_ms > 0 && at_ms > expired_after_ms) return FieldAge::kExpired;
  return aged_after_ms > 0 && at_ms > aged_after_ms ? FieldAge::kAged : FieldAge::kFresh;
}

std::string SessionState::age_reason(double at_ms) const {
  const FieldAge age = age_of(at_ms);
  if (age == FieldAge::kFresh) return {};
  const double limit_ms = age == FieldAge::kAged ? aged_after_ms : expired_after_ms;
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%.1f", 1e-3 * at_ms);
  return "its data are " + std::string(seconds) + " s old: " + text(1e-3 * limit_ms) + " s at most";
}

std::string SessionState::kind() const {
  if (session.session_id == 0) return {};
  std::string words = recorded ? "RECORDED" : "";
  for (const std::string& word : {method, boundary}) {
    if (!word.empty()) words += (words.empty() ? "" : ", ") + word;
  }
  return words;
}

bool RecordingState::holds(std::string_view source, std::uint64_t sequence) const {
  return std::any_of(sources.begin(), sources.end(), [&](const RecordedSource& recorded) {
    return recorded.source == source && sequence > recorded.lost_until &&
           sequence <= recorded.until;
  });
}

Status validate(const FieldChoice& choice) {
  if (Status status = validate(choice.region); !status) return status;
  if (Status status =
          check_range("spacing_mm", choice.spacing_mm, 0.0, true, FieldChoice::kMaxLength_mm);
      !status) {
    return status;
  }
  return check_range("tolerance_mm", choice.tolerance_mm, 0.0, true, FieldChoice::kMaxTolerance_mm);
}

}  // namespace brainshift
