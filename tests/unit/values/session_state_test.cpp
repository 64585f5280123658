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

TEST(RecordingState, HoldsWhatIsWrittenAndWasNotLost) {
  RecordingState state;
  state.sources = {{"ius", 9, 4}, {"camera", 2, 0}};
  EXPECT_TRUE(state.holds("ius", 5));
  EXPECT_TRUE(state.holds("ius", 9));
  EXPECT_TRUE(state.holds("camera", 1));
  EXPECT_FALSE(state.holds("ius", 4));
  EXPECT_FALSE(state.holds("ius", 10));
  EXPECT_FALSE(state.holds("camera", 3));
  EXPECT_FALSE(state.holds("pointer", 1));
}

}  // namespace
}  // namespace brainshift
