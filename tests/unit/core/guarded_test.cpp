// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/core/guarded.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/results.hpp"

namespace brainshift {
namespace {

TEST(Guarded, PassesValuesAndErrorsThrough) {
  const auto value = guarded(ErrorCode::kInternal, "context", []() -> Result<int> { return 7; });
  EXPECT_EQ(value_or_fail(value), 7);
  const Status error = guarded(ErrorCode::kInternal, "context",
                               []() -> Status { return fail(ErrorCode::kNotFound, "own"); });
  EXPECT_EQ(refusal_of(error, ErrorCode::kNotFound), "own");
}

TEST(Guarded, TurnsAnExceptionIntoAnErrorOfTheGivenCode) {
  const Status error = guarded(ErrorCode::kWriteFailed, "journal",
                               []() -> Status { throw std::runtime_error("disk"); });
  EXPECT_EQ(refusal_of(error, ErrorCode::kWriteFailed), "journal: disk");
}

}  // namespace
}  // namespace brainshift
