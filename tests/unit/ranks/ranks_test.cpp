// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/ranks/ranks.hpp"
#include "tests/support/results.hpp"
#include "tests/support/thread_ranks.hpp"

namespace brainshift {
namespace {

TEST(Ranks, AllHaveTheErrorOfTheFirstThatHasOne) {
  test_support::run_as_ranks(4, [](Ranks& ranks) {
    EXPECT_TRUE(ranks.agree({}).has_value());
    Status own;
    if (ranks.rank() == 1) own = invalid("of the second");
    if (ranks.rank() == 3) own = fail(ErrorCode::kNotFinite, "of the last");
    const Status all = ranks.agree(own);
    ASSERT_FALSE(all.has_value());
    EXPECT_EQ(all.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(all.error().message, "of the second");
  });
}

TEST(Ranks, PartsCoverAllThingsOnce) {
  test_support::run_as_ranks(3, [](Ranks& ranks) {
    for (const int count : {0, 1, 2, 3, 100}) {
      EXPECT_EQ(ranks.first(0, count), 0);
      EXPECT_EQ(ranks.first(3, count), count);
      for (int r = 0; r < 3; ++r) EXPECT_LE(ranks.first(r, count), ranks.first(r + 1, count));
    }
  });
}

}  // namespace
}  // namespace brainshift
