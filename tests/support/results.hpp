// SPDX-License-Identifier: GPL-3.0-or-later
// What a test makes of a Result: the value that must be there, or the sentence of a refusal. In the
// namespace of Error, so that a test calls them by their names alone.
#pragma once

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/error.hpp"

namespace brainshift {

// The value. Without one the test fails at the caller's line and ends there.
template <typename T>
T value_or_fail(Result<T> result, const char* file = __builtin_FILE(),
                int line = __builtin_LINE()) {
  if (result) return std::move(*result);
  ADD_FAILURE_AT(file, line) << result.error().message;
  throw std::runtime_error(result.error().message);
}

// The sentence with which something was refused; "" and a failure when it was not.
template <typename T>
std::string sentence_of(const Result<T>& result) {
  EXPECT_FALSE(result);
  return result ? std::string() : result.error().message;
}

// The same of an error of this code.
template <typename T>
std::string refusal_of(const Result<T>& result, ErrorCode code = ErrorCode::kUnreadable) {
  const std::string sentence = sentence_of(result);
  if (!result) {
    EXPECT_EQ(to_string(result.error().code), to_string(code)) << sentence;
  }
  return sentence;
}

}  // namespace brainshift
