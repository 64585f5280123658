// SPDX-License-Identifier: Apache-2.0
#include "common/core/thread_team.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <new>
#include <numeric>
#include <system_error>

namespace brainshift {
namespace {

TEST(ThreadTeam, RunsEveryMemberOncePerTask) {
  ThreadTeam team(3);
  ASSERT_EQ(team.size(), 3);
  std::vector<int> calls(3, 0);  // one entry per member: no two threads write the same
  auto task = [&](int member) { ++calls[static_cast<std::size_t>(member)]; };
  for (int round = 0; round < 1000; ++round) team.run(task);
  EXPECT_EQ(calls, (std::vector<int>{1000, 1000, 1000}));
}

TEST(ThreadTeam, SplitsCoverEveryItemOnceAndAlwaysAlike) {
  ThreadTeam team(3);
  for (const long count : {0L, 1L, 2L, 3L, 10L}) {
    std::vector<int> seen(static_cast<std::size_t>(count), 0);
    team.split(count, [&](long begin, long end) {
      for (long i = begin; i < end; ++i) ++seen[static_cast<std::size_t>(i)];
    });
    EXPECT_EQ(std::accumulate(seen.begin(), seen.end(), 0L), count);
    for (const int times : seen) EXPECT_EQ(times, 1);
  }
}

TEST(ThreadTeam, OneMemberIsTheCaller) {
  ThreadTeam team(1);
  std::thread::id id;
  team.split(5, [&](long, long) { id = std::this_thread::get_id(); });
  EXPECT_EQ(id, std::this_thread::get_id());
}

TEST(ThreadTeam, AnExceptionOfAnyMemberIsTheCallersOnceAllAreDone) {
  ThreadTeam team(4);
  for (int thrower = 0; thrower < 4; ++thrower) {
    std::atomic<int> done{0};
    auto task = [&](int member) {
      if (member == thrower) throw std::bad_alloc();
      ++done;
    };
    EXPECT_THROW(team.run(task), std::bad_alloc);
    EXPECT_EQ(done, 3);
  }
  std::atomic<int> done{0};
  auto task = [&](int) { ++done; };
  team.run(task);
  EXPECT_EQ(done, 4) << "the team goes on";
}

TEST(ThreadTeam, IsBoundedWhateverTheMachineHas) { EXPECT_EQ(ThreadTeam(128).size(), 16); }

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Room for some stacks and not for all.
TEST(ThreadTeamDeathTest, ThreadsThatTheSystemDoesNotGiveAreAnExceptionAndNoAbort) {
  const auto starve = [] {
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const auto bytes = static_cast<rlim_t>(pages * sysconf(_SC_PAGESIZE)) + (40u << 20);
    const rlimit limit{bytes, bytes};
    setrlimit(RLIMIT_AS, &limit);
    try {
      const ThreadTeam team(16);
      _exit(1);
    } catch (const std::system_error&) {
      _exit(0);
    }
  };
  EXPECT_EXIT(starve(), testing::ExitedWithCode(0), "");
}
#endif

}  // namespace
}  // namespace brainshift
