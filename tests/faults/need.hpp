// SPDX-License-Identifier: GPL-3.0-or-later
// The value of a Result, or an exception that ends the topic with the error's sentence.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/error.hpp"

namespace brainshift::faults {

template <typename T>
T need(Result<T> result, const std::string& what) {
  if (!result) throw std::runtime_error(what + ": " + result.error().message);
  return *std::move(result);
}

inline void need(const Status& status, const std::string& what) {
  if (!status) throw std::runtime_error(what + ": " + status.error().message);
}

}  // namespace brainshift::faults
