// SPDX-License-Identifier: Apache-2.0
// One taxonomy of expected failures for every stage, back end and wire message.
//
// A bug asserts. An expected failure (bad file, bad option, singular matrix) returns Result<T>
// that holds an Error: a code that programs branch on and one sentence that names the file, key
// or set and the offending value. The sentence is what the command line prints; it never spans
// lines.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace brainshift {

enum class ErrorCode {
  kInvalidArgument,  // a value, key or option outside its stated range
  kNotFound,         // a file, scenario, case or record that does not exist
  kUnreadable,       // a file that exists but cannot be read, or is not what its name says
  kWriteFailed,      // a file that could not be written completely
  kDegenerateMesh,   // inverted, flat or disconnected elements
  kEmptySet,         // a node set, mask or data set that selects nothing
  kFloatingBody,     // not enough support: the stiffness matrix is singular
  kSingularMatrix,   // factorisation failed for another reason
  kNotFinite,        // NaN or infinity where a number is needed
  kNotConverged,     // iteration limit reached
  kModelNotReady,    // asked before a model is loaded
  kProtocol,         // malformed, truncated, oversized or unknown message
  kUnavailable,      // peer not reachable or timed out, or a limit for now: try again later
  kNotAllowed,       // the caller's role does not include it
  kInternal,         // an error of this program
};

// Stable lower-case name, used on the wire and in logs ("invalid_argument").
std::string_view to_string(ErrorCode code);

struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;
};

template <typename T>
using Result = tl::expected<T, Error>;
using Status = tl::expected<void, Error>;

inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}
// The failure that is met most: a value, key or option that is not allowed.
inline tl::unexpected<Error> invalid(std::string message) {
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

}  // namespace brainshift
