// SPDX-License-Identifier: GPL-3.0-or-later
// For benchmarks that end at the first error.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "common/core/error.hpp"

namespace brainshift::bench {

// The value. On an error: prints its sentence to stderr and exits with status 2.
template <typename T>
T value_or_exit(Result<T> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "benchmark: %s\n", result.error().message.c_str());
  std::exit(2);
}

}  // namespace brainshift::bench
