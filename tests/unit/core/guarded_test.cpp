// SPDX-License-Identifier: Apache-2.0
#include "common/core/guarded.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace brainshift {
namespace {

TEST(Guarded, PassesResultsAndErrorsOn) {
  const auto value = guarded(ErrorCode::kInternal, "context", []() -> Result<int> { return 7; });
  ASSERT_TRUE(value.has_value());
  EXPECT_EQ(*value, 7);
  const Status error = guarded(ErrorCode::kInternal, "context", []() -> Status {
    return fail(ErrorCode::kNotFound, "no such file");
  });
  ASSERT_FALSE(error.has_value());
  EXPECT_EQ(error.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(error.error().message, "no such file");
}

TEST(Guarded, AnExceptionBecomesAnErrorWithItsContext) {
  const Status error = guarded(ErrorCode::kWriteFailed, "journal",
                               []() -> Status { throw std::runtime_error("disk full"); });
  ASSERT_FALSE(error.has_value());
  EXPECT_EQ(error.error().code, ErrorCode::kWriteFailed);
  EXPECT_EQ(error.error().message, "journal: disk full");
}

}  // namespace
}  // namespace brainshift
