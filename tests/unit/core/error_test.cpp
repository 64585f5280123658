// SPDX-License-Identifier: Apache-2.0
#include "common/core/error.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

namespace brainshift {
namespace {

constexpr ErrorCode kCodes[] = {
    ErrorCode::kInvalidArgument, ErrorCode::kNotFound,       ErrorCode::kUnreadable,
    ErrorCode::kWriteFailed,     ErrorCode::kDegenerateMesh, ErrorCode::kEmptySet,
    ErrorCode::kFloatingBody,    ErrorCode::kSingularMatrix, ErrorCode::kNotFinite,
    ErrorCode::kNotConverged,    ErrorCode::kModelNotReady,  ErrorCode::kProtocol,
    ErrorCode::kUnavailable,     ErrorCode::kNotAllowed,     ErrorCode::kInternal};

TEST(ErrorCodeNames, AreDistinctLowerCaseWords) {
  std::set<std::string> names;
  for (const ErrorCode code : kCodes) {
    const std::string name(to_string(code));
    EXPECT_TRUE(std::regex_match(name, std::regex("[a-z]+(_[a-z]+)*"))) << name;
    EXPECT_TRUE(names.insert(name).second) << name << " names two codes";
  }
}

// Clients and logs depend on these words.
TEST(ErrorCodeNames, AreStable) {
  EXPECT_EQ(to_string(ErrorCode::kInvalidArgument), "invalid_argument");
  EXPECT_EQ(to_string(ErrorCode::kModelNotReady), "model_not_ready");
  EXPECT_EQ(to_string(ErrorCode::kNotAllowed), "not_allowed");
  EXPECT_EQ(to_string(ErrorCode::kInternal), "internal");
}

TEST(Fail, CarriesCodeAndMessage) {
  const Status status = fail(ErrorCode::kEmptySet, "craniotomy selects no node");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kEmptySet);
  EXPECT_EQ(status.error().message, "craniotomy selects no node");
  const Result<int> result = fail(ErrorCode::kNotFound, "x");
  EXPECT_FALSE(result);
}

}  // namespace
}  // namespace brainshift
