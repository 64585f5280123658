// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/core/guarded.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace brainshift {
namespace {

TEST(Guarded, PassesValuesAndErrorsThrough) {
  const auto value = guarded(ErrorCode::kInternal, "context", []() -> Result<int> { return 7; });
  ASSERT_TRUE(value.has_value());
  EXPECT_EQ(*value, 7);
  const Status error = guarded(ErrorCode::kInternal, "context",
                               []() -> Status { return fail(ErrorCode::kNotFound, "own"); });
  ASSERT_FALSE(error.has_value());
  EXPECT_EQ(error.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(error.error().message, "own");
}

TEST(Guarded, TurnsAnExceptionIntoAnErrorOfTheGivenCode) {
  const Status error = guarded(ErrorCode::kWriteFailed, "journal",
                               []() -> Status { throw std::runtime_error("disk"); });
  ASSERT_FALSE(error.has_value());
  EXPECT_EQ(error.error().code, ErrorCode::kWriteFailed);
  EXPECT_EQ(error.error().message, "journal: disk");
}

}  // namespace
}  // namespace brainshift
