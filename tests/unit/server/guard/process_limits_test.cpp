// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/process_limits.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace brainshift::server {
namespace {

TEST(FileLimit, ConnectionsLeaveTheReserveAlone) {
  for (const long limit : {256L, 1024L, 3000L}) {
    EXPECT_LE(connections_within(limit) * kFilesPerConnection + kReservedFiles, limit) << limit;
  }
  EXPECT_EQ(connections_within(256), 53);
  EXPECT_EQ(connections_within(1), 1);
  EXPECT_EQ(connections_within(1'000'000'000), 1024);
}

TEST(FileLimit, TheSoftLimitBecomesTheHardOne) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  rlimit low = limit;
  low.rlim_cur = 200;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  EXPECT_GE(raise_file_limit(), 200);
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  EXPECT_EQ(limit.rlim_cur, limit.rlim_max);
}

}  // namespace
}  // namespace brainshift::server
