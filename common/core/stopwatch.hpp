// SPDX-License-Identifier: Apache-2.0
// Stopwatch: time that has passed since it was made, on the monotonic clock.
#pragma once

#include <chrono>
#include <ctime>

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

// A monotonic clock that also runs while the computer sleeps, for ages that are shown: Linux's
// steady_clock (CLOCK_MONOTONIC) stands still then.
struct BootClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<BootClock>;
  static constexpr bool is_steady = true;

  static time_point now() {
    timespec time{};
    clock_gettime(CLOCK_BOOTTIME, &time);
    return time_point(std::chrono::seconds(time.tv_sec) + duration(time.tv_nsec));
  }
};

// How long this computer has slept since it was started.
inline std::chrono::nanoseconds asleep() {
  return BootClock::now().time_since_epoch() - std::chrono::steady_clock::now().time_since_epoch();
}

}  // namespace brainshift
