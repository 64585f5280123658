// SPDX-License-Identifier: Apache-2.0
// Stopwatch: time that has passed since it was made, on the monotonic clock.
#pragma once

#include <chrono>

namespace brainshift {

class Stopwatch {
 public:
  using Clock = std::chrono::steady_clock;

  Stopwatch() : start_(Clock::now()) {}

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double milliseconds() const { return 1e3 * seconds(); }

 private:
  Clock::time_point start_;
};

}  // namespace brainshift
