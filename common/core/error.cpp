// SPDX-License-Identifier: Apache-2.0
#include "common/core/error.hpp"

namespace brainshift {

std::string_view to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument: return "invalid_argument";
    case ErrorCode::kNotFound: return "not_found";
    case ErrorCode::kUnreadable: return "unreadable";
    case ErrorCode::kWriteFailed: return "write_failed";
    case ErrorCode::kDegenerateMesh: return "degenerate_mesh";
    case ErrorCode::kEmptySet: return "empty_set";
    case ErrorCode::kFloatingBody: return "floating_body";
    case ErrorCode::kSingularMatrix: return "singular_matrix";
    case ErrorCode::kNotFinite: return "not_finite";
    case ErrorCode::kNotConverged: return "not_converged";
    case ErrorCode::kModelNotReady: return "model_not_ready";
    case ErrorCode::kProtocol: return "protocol";
    case ErrorCode::kUnavailable: return "unavailable";
    case ErrorCode::kNotAllowed: return "not_allowed";
    case ErrorCode::kInternal: return "internal";
  }
  return "internal";
}

}  // namespace brainshift
