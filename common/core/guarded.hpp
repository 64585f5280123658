// SPDX-License-Identifier: Apache-2.0
// guarded(): a call into code that may throw, as a call that returns an error.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift {

// function() returns a Status or a Result. An exception becomes an Error of this code,
// "CONTEXT: what()".
template <typename Function>
auto guarded(ErrorCode code, std::string_view context, Function&& function)
    -> decltype(function()) {
  try {
    return function();
  } catch (const std::exception& exception) {
    return fail(code, std::string(context) + ": " + exception.what());
  }
}

}  // namespace brainshift
