// SPDX-License-Identifier: GPL-3.0-or-later
// sheltered(): a step of a thread that must go on when the step fails. Memory that is not to be had
// costs what was being done, and nothing after it.
#pragma once

#include <spdlog/spdlog.h>

#include <exception>
#include <utility>

namespace brainshift::server {

// Calls function(). An exception is logged as "WHAT failed"; false then.
template <typename Function>
bool sheltered(const char* what, Function&& function) {
  try {
    std::forward<Function>(function)();
    return true;
  } catch (const std::exception& exception) {
    spdlog::error("{} failed: {}", what, exception.what());  // throws nothing (spdlog)
    return false;
  }
}

}  // namespace brainshift::server
