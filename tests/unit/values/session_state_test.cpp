// SPDX-License-Identifier: Apache-2.0
#include "common/values/session_state.hpp"

#include <gtest/gtest.h>

#include <set>

namespace brainshift {
namespace {

TEST(SessionPhase, EachHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (int phase = 0; phase <= static_cast<int>(SessionPhase::kClosed); ++phase) {
    names.insert(to_string(static_cast<SessionPhase>(phase)));
  }
  EXPECT_EQ(names.size(), 6u);
  EXPECT_EQ(names.count("unknown"), 0u);
}

TEST(SessionKey, DiffersWithEachMember) {
  const SessionKey key{1, 2, "m"};
  EXPECT_EQ(key, (SessionKey{1, 2, "m"}));
  for (const SessionKey& other : {SessionKey{9, 2, "m"}, {1, 9, "m"}, {1, 2, "x"}}) {
    EXPECT_NE(key, other);
  }
}

}  // namespace
}  // namespace brainshift
