// SPDX-License-Identifier: Apache-2.0
// Enumerators from their stable names. Private to common/wire.
#pragma once

#include <optional>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::wire {

// The enumerator in [first, last] whose to_string() is `name`. Precondition: enumerators are
// contiguous.
template <typename Enum>
std::optional<Enum> from_name(std::string_view name, Enum first, Enum last) {
  for (int i = static_cast<int>(first); i <= static_cast<int>(last); ++i) {
    if (to_string(static_cast<Enum>(i)) == name) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

inline std::optional<ErrorCode> error_code_from(std::string_view name) {
  return from_name(name, ErrorCode::kInvalidArgument, ErrorCode::kInternal);
}
inline std::optional<Method> method_from(std::string_view name) {
  return from_name(name, Method::kCondensed, Method::kIterativeSolver);
}
inline std::optional<Boundary> boundary_from(std::string_view name) {
  return from_name(name, Boundary::kContact, Boundary::kFixed);
}
inline std::optional<EstimateStatus> estimate_status_from(std::string_view name) {
  return from_name(name, EstimateStatus::kNotRun, EstimateStatus::kDeadline);
}
inline std::optional<PriorPart> prior_part_from(std::string_view name) {
  return from_name(name, PriorPart{}, static_cast<PriorPart>(kPriorParts - 1));
}

// The error that a peer reported, on one line. An unknown code (a newer version's) becomes
// kInternal and stays in the sentence.
Error make_error(std::string_view code, std::string_view message);

}  // namespace brainshift::wire
