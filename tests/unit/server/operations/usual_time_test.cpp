// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/usual_time.hpp"

#include <gtest/gtest.h>

namespace brainshift::server {
namespace {

double usual_ms(UsualTime& usual, std::uint64_t session_id) {
  return usual.answer(session_id, 0.0, false).usual_ms;
}

TEST(UsualTime, NothingIsUsualUntilThereAreAFewAnswers) {
  UsualTime usual;
  for (std::uint64_t i = 0; i < UsualTime::kFew; ++i) {
    const AnswerTime time = usual.answer(1, 30.0, true);
    EXPECT_EQ(time.ms, 30.0);
    EXPECT_EQ(time.usual_ms, 0.0) << i;
  }
  EXPECT_NEAR(usual_ms(usual, 1), 30.0, 0.3);
}

TEST(UsualTime, IsTheMedianOfAllAnswersOfTheSessionThatCount) {
  UsualTime usual;
  for (int i = 0; i < 3000; ++i) usual.answer(1, 20.0, true);
  for (int i = 0; i < 2900; ++i) usual.answer(1, 500.0, true);  // long, but not for most of it
  for (int i = 0; i < 2900; ++i) usual.answer(1, 900.0, false);
  EXPECT_NEAR(usual_ms(usual, 1), 20.0, 0.2);
  for (int i = 0; i < 200; ++i) usual.answer(1, 500.0, true);
  EXPECT_NEAR(usual_ms(usual, 1), 500.0, 5.0);
}

TEST(UsualTime, AnotherSessionBeginsAnew) {
  UsualTime usual;
  for (std::uint64_t i = 0; i < 2 * UsualTime::kFew; ++i) usual.answer(1, 20.0, true);
  EXPECT_GT(usual_ms(usual, 1), 0.0);
  EXPECT_EQ(usual_ms(usual, 2), 0.0);
  EXPECT_EQ(usual_ms(usual, 1), 0.0) << "of a session that is over, nothing is kept";
}

}  // namespace
}  // namespace brainshift::server
