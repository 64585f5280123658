// SPDX-License-Identifier: GPL-3.0-or-later
// NumberCursor: walks a file's numbers from front to back, as text or in binary, so that a reader
// of nested lists stays a plain list of numbers. It throws FormatProblem, which the parsers of mesh
// files catch (format_problems_as_errors): no exception leaves them.
#pragma once

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>

#include "common/io/files/binary_codec.hpp"

namespace brainshift::io {

struct FormatProblem {
  std::string message;
};

[[noreturn]] inline void refuse_format(const std::string& message) { throw FormatProblem{message}; }

// What read() returns; kUnreadable for a FormatProblem.
template <typename Read>
auto format_problems_as_errors(const Read& read) -> Result<decltype(read())> {
  try {
    return read();
  } catch (const FormatProblem& problem) {
    return fail(ErrorCode::kUnreadable, problem.message);
  }
}

// The other way round: the value, or a FormatProblem with the error's sentence.
template <typename T>
T value_of(Result<T> result) {
  if (!result) refuse_format(result.error().message);
  return std::move(*result);
}

// read(), with `place` in front of a FormatProblem's sentence.
template <typename Read>
auto placed(const std::string& place, const Read& read) {
  try {
    return read();
  } catch (const FormatProblem& problem) {
    refuse_format(place + problem.message);
  }
}

class NumberCursor {
 public:
  explicit NumberCursor(std::string_view content) : rest_(content) {}

  // What is read from now on; a sentence on a number that is missing begins with it.
  void enter(std::string place) { place_ = std::move(place); }
  std::string_view rest() const { return rest_; }
  void skip(std::size_t bytes) { rest_.remove_prefix(std::min(bytes, rest_.size())); }
  template <typename T>
  T text_number() {
    skip(rest_.find_first_not_of(" \t\r\n"));
    T value{};
    const auto [stop, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc()) {
      refuse_format(place_ + "ends too early or holds something that is not a number");
    }
    skip(static_cast<std::size_t>(stop - rest_.data()));
    return value;
  }
  template <typename T>
  T binary_number(bool swap) {
    if (rest_.size() < sizeof(T)) refuse_format(place_ + "ends too early");
    const T value = load_number<T>(rest_.data(), swap);
    skip(sizeof(T));
    return value;
  }

 private:
  std::string_view rest_;
  std::string place_;  // "", or with a space behind it
};

}  // namespace brainshift::io
