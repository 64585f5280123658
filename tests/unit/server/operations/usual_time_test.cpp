// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/usual_time.hpp"

#include <gtest/gtest.h>

namespace brainshift::server {
namespace {

TEST(UsualTime, NothingIsUsualUntilThereAreAFewAnswers) {
  UsualTime usual;
  for (std::uint64_t i = 0; i < UsualTime::kFew; ++i) {
    EXPECT_EQ(usual.of(1), 0.0) << i;
    usual.add(30.0);
  }
  EXPECT_NEAR(usual.of(1), 30.0, 0.3);
}

TEST(UsualTime, IsTheMedianOfAllAnswersOfTheSession) {
  UsualTime usual;
  EXPECT_EQ(usual.of(1), 0.0);
  for (int i = 0; i < 3000; ++i) usual.add(20.0);
  for (int i = 0; i < 2900; ++i) usual.add(500.0);  // long, but not for most of it
  EXPECT_NEAR(usual.of(1), 20.0, 0.2);
  for (int i = 0; i < 200; ++i) usual.add(500.0);
  EXPECT_NEAR(usual.of(1), 500.0, 5.0);
}

TEST(UsualTime, AnotherSessionBeginsAnew) {
  UsualTime usual;
  EXPECT_EQ(usual.of(1), 0.0);
  for (std::uint64_t i = 0; i < 2 * UsualTime::kFew; ++i) usual.add(20.0);
  EXPECT_GT(usual.of(1), 0.0);
  EXPECT_EQ(usual.of(2), 0.0);
  EXPECT_EQ(usual.of(1), 0.0) << "of a session that is over, nothing is kept";
}

}  // namespace
}  // namespace brainshift::server
