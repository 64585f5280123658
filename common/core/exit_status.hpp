// SPDX-License-Identifier: Apache-2.0
// The exit status of this project's programs: 0 success, 2 bad usage
// or bad input, 1 any other failure.
#pragma once

#include "common/core/error.hpp"

namespace brainshift {

inline constexpr int kExitSuccess = 0;
inline constexpr int kExitFailure = 1;
inline constexpr int kExitBadInput = 2;

// kExitBadInput for what the user can mend in arguments or files, else kExitFailure.
constexpr int exit_status(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kNotFound:
    case ErrorCode::kUnreadable:
    case ErrorCode::kDegenerateMesh:
    case ErrorCode::kEmptySet:
    case ErrorCode::kFloatingBody:
    case ErrorCode::kNotFinite: return kExitBadInput;
    case ErrorCode::kWriteFailed:
    case ErrorCode::kSingularMatrix:
    case ErrorCode::kNotConverged:
    case ErrorCode::kModelNotReady:
    case ErrorCode::kProtocol:
    case ErrorCode::kUnavailable:
    case ErrorCode::kNotAllowed:
    case ErrorCode::kInternal: return kExitFailure;
  }
  return kExitFailure;
}

}  // namespace brainshift
