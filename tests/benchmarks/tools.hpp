// SPDX-License-Identifier: GPL-3.0-or-later
// What benchmarks share: they end at the first error, and time pieces of work.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"

namespace brainshift::bench {

// The value. On an error: prints its sentence to stderr and exits with status 2.
template <typename T>
T value_or_exit(Result<T> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "benchmark: %s\n", result.error().message.c_str());
  std::exit(2);
}

// Median time of one call of `work`, ms, over `repetitions` calls. `warm_up` uncounted calls come
// first.
template <typename Work>
double median_ms(const Work& work, int repetitions, int warm_up = 0) {
  std::vector<double> times_ms;
  for (int i = 0; i < warm_up + repetitions; ++i) {
    const Stopwatch watch;
    work();
    if (i >= warm_up) times_ms.push_back(watch.milliseconds());
  }
  return percentile(times_ms, 50.0);
}

}  // namespace brainshift::bench
