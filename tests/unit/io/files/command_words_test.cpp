// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/command_words.hpp"

#include <gtest/gtest.h>

namespace brainshift::io {
namespace {

TEST(NearestWord, IsTheOneWithTheFewestSlips) {
  const std::vector<std::string> words = {"replay", "report", "view", "top", "init"};
  EXPECT_EQ(nearest_word("repaly", words), "replay") << "swapped letters";
  EXPECT_EQ(nearest_word("reprot", words), "report");
  EXPECT_EQ(nearest_word("vieww", words), "view");
  EXPECT_EQ(nearest_word("tp", words), "top");
}

TEST(NearestWord, IsNoneWhereNoneIsNear) {
  const std::vector<std::string> words = {"replay", "top"};
  EXPECT_EQ(nearest_word("dance", words), "");
  EXPECT_EQ(nearest_word("tip-toe", words), "");
  EXPECT_EQ(nearest_word("a", words), "") << "half of a short word changed is another word";
  EXPECT_EQ(nearest_word("", {}), "");
  EXPECT_EQ(nearest_word(std::string(100000, 'x'), words), "");
}

}  // namespace
}  // namespace brainshift::io
