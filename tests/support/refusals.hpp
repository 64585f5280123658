// SPDX-License-Identifier: GPL-3.0-or-later
// What readers say of bad input, as tables: one line for each input and the words by which the
// sentence must name what is wrong.
#pragma once

#include <gmock/gmock.h>

#include <initializer_list>
#include <string>

#include "common/core/error.hpp"
#include "tests/support/results.hpp"

namespace brainshift::test_support {

// `text` with the first `from` in it replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "'" << from << "' is not there";
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

struct BadInput {
  std::string input;
  std::string words;  // of the sentence
};

// read: input -> a Result.
template <typename Read>
void expect_refused(const Read& read, std::initializer_list<BadInput> cases,
                    ErrorCode code = ErrorCode::kUnreadable) {
  for (const auto& [input, words] : cases) {
    SCOPED_TRACE("must say: " + words + "\nof:\n" + input.substr(0, 2000));
    EXPECT_THAT(refusal_of(read(input), code), testing::HasSubstr(words));
  }
}

struct BadEdit {
  std::string from;
  std::string to;
  std::string words;
};

// The same for texts that are like a good one but for one place.
template <typename Read>
void expect_edits_refused(const Read& read, const std::string& good,
                          std::initializer_list<BadEdit> cases,
                          ErrorCode code = ErrorCode::kUnreadable) {
  for (const auto& [from, to, words] : cases) {
    expect_refused(read, {{replaced(good, from, to), words}}, code);
  }
}

}  // namespace brainshift::test_support
