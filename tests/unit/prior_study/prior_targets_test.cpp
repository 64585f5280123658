// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_targets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace brainshift::prior_study {
namespace {

using ::testing::HasSubstr;

const std::string kHeading = "place,quantile_pct,target_mm,low_mm,high_mm,source\n";
const std::string kRows =
    "cortex,5,1,0.5,2,A 2001\ncortex,50,5,4,6,A 2001\ncortex,95,13,10,16,A 2001\n"
    "tumour,5,1,0.5,2,B\ntumour,50,3,2,4,B\ntumour,95,9,7,12,B\n"
    "far side,5,0.1,0,0.3,C\nfar side,50,0.7,0.4,1.2,C\n";
const std::string kLast = "far side,95,2,1,4,C\n";

std::string refusal(const std::string& text) {
  const auto targets = parse_targets(text, "t.csv");
  if (targets) return "accepted";
  EXPECT_EQ(targets.error().code, ErrorCode::kUnreadable);
  return targets.error().message;
}

TEST(PriorTargets, KeepWhatTheTableSays) {
  const auto targets = parse_targets(kHeading + kRows + kLast, "t.csv");
  ASSERT_TRUE(targets) << targets.error().message;
  ASSERT_EQ(targets->size(), 9u);
  const Target* target = find_target(*targets, 2, 50.0);
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->target_mm, 0.7);
  EXPECT_EQ(target->source, "C");
  EXPECT_EQ(find_target(*targets, 0, 25.0), nullptr);
}

TEST(PriorTargets, BracketHoldsItsEnds) {
  Target target;
  target.low_mm = 1.0;
  target.high_mm = 2.0;
  EXPECT_TRUE(target.holds(1.0) && target.holds(2.0));
  EXPECT_FALSE(target.holds(0.999) || target.holds(2.001));
  EXPECT_FALSE(target.holds(std::numeric_limits<double>::quiet_NaN()));
}

TEST(PriorTargets, NameTheLineThatIsWrong) {
  const std::string begin = kHeading + kRows;
  EXPECT_THAT(refusal(begin + "ear,95,2,1,4,C\n"), HasSubstr("t.csv: line 10: place \"ear\""));
  EXPECT_THAT(refusal(begin + "far side,75,2,1,4,C\n"), HasSubstr("line 10: quantile_pct"));
  EXPECT_THAT(refusal(begin + "far side,,2,1,4,C\n"), HasSubstr("line 10: quantile_pct"));
  EXPECT_THAT(refusal(begin + "far side,95,2,1,4,\n"), HasSubstr("line 10: source"));
  EXPECT_THAT(refusal(begin + "far side,50,2,1,4,C\n"), HasSubstr("line 10: place and quantile"));
  for (const char* const numbers : {"2,3,4", "2,1,1.5", "2,-1,4", "two,1,4", ",1,4", "nan,1,4"}) {
    EXPECT_THAT(refusal(begin + "far side,95," + numbers + ",C\n"),
                HasSubstr("line 10: must be 0 <= low_mm <= target_mm <= high_mm"))
        << numbers;
  }
}

TEST(PriorTargets, MustBeComplete) {
  EXPECT_THAT(refusal(kHeading + kRows), HasSubstr("no target for far side, quantile_pct 95"));
  EXPECT_THAT(refusal("place,target_mm\ncortex,3\n"), HasSubstr("line 2: quantile_pct"));
  EXPECT_THAT(refusal(kHeading), HasSubstr("no target for cortex"));
  EXPECT_EQ(read_targets("/nowhere/t.csv").error().code, ErrorCode::kNotFound);
}

TEST(PriorTargets, OfTheRepositoryCanBeRead) {
  const auto targets = read_targets(BRAINSHIFT_SOURCE_DIR "/tests/prior_study/targets.csv");
  EXPECT_TRUE(targets) << targets.error().message;
}

}  // namespace
}  // namespace brainshift::prior_study
