// SPDX-License-Identifier: Apache-2.0
#include "common/core/exit_status.hpp"

#include <gtest/gtest.h>

namespace brainshift {
namespace {

// Scripts rely on these numbers (docs: command line).
TEST(ExitStatus, IsTwoForWhatTheUserCanMendAndOneOtherwise) {
  EXPECT_EQ(kExitSuccess, 0);
  for (const ErrorCode code :
       {ErrorCode::kInvalidArgument, ErrorCode::kNotFound, ErrorCode::kUnreadable,
        ErrorCode::kDegenerateMesh, ErrorCode::kEmptySet, ErrorCode::kFloatingBody,
        ErrorCode::kNotFinite}) {
    EXPECT_EQ(exit_status(code), 2) << to_string(code);
  }
  for (const ErrorCode code :
       {ErrorCode::kWriteFailed, ErrorCode::kSingularMatrix, ErrorCode::kNotConverged,
        ErrorCode::kModelNotReady, ErrorCode::kProtocol, ErrorCode::kUnavailable,
        ErrorCode::kNotAllowed, ErrorCode::kInternal}) {
    EXPECT_EQ(exit_status(code), 1) << to_string(code);
  }
}

}  // namespace
}  // namespace brainshift
