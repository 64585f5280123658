// SPDX-License-Identifier: Apache-2.0
#include "common/core/stopwatch.hpp"

#include <gtest/gtest.h>

namespace brainshift {
namespace {

TEST(Stopwatch, LiesBetweenTheClockReadingsAroundIt) {
  const auto outer_start = Stopwatch::Clock::now();
  const Stopwatch watch;
  const auto inner_start = Stopwatch::Clock::now();
  // Long enough to be seen by a clock of nanoseconds, whatever the machine.
  while (Stopwatch::Clock::now() - inner_start < std::chrono::microseconds(200)) {
  }
  const auto inner_end = Stopwatch::Clock::now();
  const double seconds = watch.seconds();
  const double milliseconds = watch.milliseconds();
  const auto outer_end = Stopwatch::Clock::now();
  const auto s = [](auto duration) { return std::chrono::duration<double>(duration).count(); };
  EXPECT_GE(seconds, s(inner_end - inner_start));
  EXPECT_LE(seconds, s(outer_end - outer_start));
  EXPECT_GE(milliseconds, 1e3 * seconds);
  EXPECT_LE(milliseconds, 1e3 * s(outer_end - outer_start));
}

TEST(BootClock, RunsAtLeastAsLongAsTheMonotonicOne) {
  const auto before = asleep();
  const auto first = BootClock::now();
  EXPECT_GE(before.count(), -1'000'000) << "it leaves nothing out";
  EXPECT_GE(BootClock::now(), first);
  EXPECT_LT(asleep() - before, std::chrono::seconds(60)) << "awake: both run alike";
}

}  // namespace
}  // namespace brainshift
