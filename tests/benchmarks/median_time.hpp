// SPDX-License-Identifier: GPL-3.0-or-later
// The time of a piece of work, repeated.
#pragma once

#include <vector>

#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"

namespace brainshift::bench {

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
