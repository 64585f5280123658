// SPDX-License-Identifier: Apache-2.0
#include "common/values/estimate.hpp"

#include <cstdio>

namespace brainshift {

std::string_view to_string(Boundary boundary) {
  return boundary == Boundary::kContact ? "contact" : "fixed";
}

std::string_view to_string(Method method) {
  static constexpr std::string_view kNames[] = {"condensed", "paper", "paper-woodbury", "pcg"};
  return enum_name<Method::kIterativeSolver>(method, kNames);
}

std::string_view to_string(PriorPart part) {
  static constexpr std::string_view kNames[] = {
      "along_gravity", "across_gravity", "gravity_sides", "gravity_ends", "tumour_volume",
      "brain_volume",  "resection",      "opening",       "ventricles",   "tract",
      "fine",          "medium",         "coarse",        "far"};
  return enum_name<PriorPart::kFar>(part, kNames);
}

std::string_view to_string(EstimateStatus status) {
  static constexpr std::string_view kNames[] = {"not_run", "iterating", "converged",
                                                "iteration_limit", "deadline"};
  return enum_name<EstimateStatus::kDeadline>(status, kNames);
}

std::string sentence(const AnswerTime& time) {
  char text[96];
  std::snprintf(text, sizeof text, "answered %.4g ms after its observation came, usually %.3g ms",
                time.ms, time.usual_ms);
  return text;
}

}  // namespace brainshift
