// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/update_deadline.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace brainshift::inversion {
namespace {

// An update on a clock of its own: a search that asks every `step_ms` and would take `search_ms`,
// and what follows it. When it ends, ms.
struct MadeUpUpdate {
  double search_ms, step_ms, after_ms;
};
double play(UpdateDeadline& deadline, double& now, const MadeUpUpdate& update) {
  const double began = now;
  deadline.begin();
  for (double spent = 0.0; spent < update.search_ms && !deadline.over();) {
    now += update.step_ms;
    spent += update.step_ms;
  }
  now += update.after_ms;
  deadline.end();
  return now - began;
}

TEST(UpdateDeadline, OneLateUpdateTellsTheNextWhenToEnd) {
  double now = 5.0;
  UpdateDeadline deadline(100.0, [&now] { return now; });
  EXPECT_LE(play(deadline, now, {1e6, 7.0, 60.0}), 50.0 + 7.0 + 60.0);  // asks until 50
  for (const double after : {60.0, 58.0, 40.0, 45.0, 47.0}) {
    const double took = play(deadline, now, {1e6, 7.0, after});
    EXPECT_LE(took, 100.0);
    EXPECT_GT(took, after) << "a search begins";
  }
}

TEST(UpdateDeadline, CountsWhatWasSpentBeforeTheInversion) {
  double now = 7.0;
  UpdateDeadline deadline(100.0, [&now] { return now; });
  deadline.begin(30.0);
  now += 15.0;
  EXPECT_FALSE(deadline.over());
  now += 10.0;
  EXPECT_TRUE(deadline.over()) << "55 are spent, half the deadline is kept for the end";
}

TEST(UpdateDeadline, AnUpdateThatEndsInTimeIsNotCut) {
  double now = 0.0;
  UpdateDeadline deadline(3000.0, [&now] { return now; });
  for (int i = 0; i < 3; ++i) EXPECT_EQ(play(deadline, now, {1500.0, 10.0, 40.0}), 1540.0);
  // Known by now: all but twice the 50 ms that those took after their last question.
  EXPECT_EQ(play(deadline, now, {2890.0, 10.0, 40.0}), 2930.0);
}

TEST(UpdateDeadline, AnEndLongerThanTheDeadlineLeavesASearchAPartOfIt) {
  double now = 0.0;
  UpdateDeadline deadline(100.0, [&now] { return now; });
  for (int i = 0; i < 3; ++i) play(deadline, now, {1e6, 1.0, 500.0});
  EXPECT_NEAR(play(deadline, now, {1e6, 1.0, 500.0}), 520.0, 1.5);
}

TEST(UpdateDeadline, AMinuteOfSleepIsForgotten) {
  double now = 0.0;
  UpdateDeadline deadline(3000.0, [&now] { return now; });
  play(deadline, now, {60.0, 10.0, 40.0});
  play(deadline, now, {70000.0, 60000.0, 40.0});
  EXPECT_LT(play(deadline, now, {2000.0, 10.0, 40.0}), 700.0) << "cut short";
  for (int i = 0; i < 60; ++i) play(deadline, now, {60.0, 10.0, 40.0});
  EXPECT_EQ(play(deadline, now, {2800.0, 10.0, 40.0}), 2840.0);
}

TEST(UpdateDeadline, TellsEveryThreadThatAsks) {
  UpdateDeadline deadline(1e-9);
  deadline.begin();
  std::vector<std::thread> threads;
  std::atomic<int> told = 0;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      while (!deadline.over()) {
      }
      ++told;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(told, 4);
}

}  // namespace
}  // namespace brainshift::inversion
