// SPDX-License-Identifier: Apache-2.0
// How a test damages a message, and what it expects of the answer.
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "common/core/error.hpp"
#include "tests/support/results.hpp"

namespace brainshift::wire {

// The numbers that no message may carry, and what a test calls them.
inline constexpr double kNotFinite[] = {std::numeric_limits<double>::quiet_NaN(),
                                        std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity()};
inline std::string name_of_number(const ::testing::TestParamInfo<double>& number) {
  if (std::isnan(number.param)) return "Nan";
  return number.param > 0.0 ? "Infinity" : "MinusInfinity";
}

template <typename T>
void expect_refused(const Result<T>& result, ErrorCode code, const std::string& text) {
  EXPECT_THAT(
      refusal_of(result, code),
      ::testing::AllOf(::testing::HasSubstr(text), ::testing::Not(::testing::HasSubstr("\n"))));
}

// The sample message, parsed, changed, and serialised again.
template <typename Message>
std::string changed(const std::string& payload, const std::function<void(Message&)>& change) {
  Message message;
  EXPECT_TRUE(message.ParseFromString(payload));
  change(message);
  return message.SerializeAsString();
}

}  // namespace brainshift::wire
