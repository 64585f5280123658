// SPDX-License-Identifier: Apache-2.0
#include "common/values/quality.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <set>
#include <string>

#include "common/values/estimate.hpp"

namespace brainshift {
namespace {

// Names are keys of reports, bits are numbers of the wire: neither may change.
TEST(Quality, NamesAndBitsAreStable) {
  EXPECT_EQ(to_string(Quality::kNotJudged), "not_judged");
  EXPECT_EQ(to_string(Quality::kGood), "good");
  EXPECT_EQ(to_string(Quality::kCaution), "caution");
  EXPECT_EQ(to_string(Quality::kUnusable), "unusable");
  std::map<std::string_view, int> bits;
  for (const QualityFlag flag : kAllQualityFlags) {
    bits[to_string(flag)] = std::countr_zero(static_cast<std::uint32_t>(flag));
  }
  const std::map<std::string_view, int> expected = {
      {"misfit_unexplained", 0},  {"strength_at_bound", 1}, {"sources_contradict", 2},
      {"data_outside_region", 3}, {"deadline", 4},          {"contact_not_certified", 5},
      {"iteration_limit", 6},     {"mostly_prior", 7},      {"inverted_elements", 16},
      {"volume_lost", 17},        {"beyond_skull", 18},     {"not_finite", 19}};
  EXPECT_EQ(bits, expected);
}

TEST(Quality, EveryFlagHasASentenceOfItsOwn) {
  std::set<std::string_view> sentences;
  for (const QualityFlag flag : kAllQualityFlags) sentences.insert(sentence(flag));
  EXPECT_EQ(sentences.size(), kAllQualityFlags.size());
  EXPECT_FALSE(sentences.contains(""));
}

TEST(Quality, FollowsFromTheFlags) {
  EXPECT_EQ(QualityFlags{}.quality(), Quality::kGood);
  for (const QualityFlag flag : kAllQualityFlags) {
    SCOPED_TRACE(to_string(flag));
    const bool upper = std::countr_zero(static_cast<std::uint32_t>(flag)) >= 16;
    QualityFlags flags;
    EXPECT_FALSE(flags.has(flag));
    flags.set(flag);
    EXPECT_TRUE(flags.has(flag));
    EXPECT_EQ(flags.quality(), upper ? Quality::kUnusable : Quality::kCaution);
    flags.set(QualityFlag::kDeadline);
    EXPECT_EQ(flags.quality(), upper ? Quality::kUnusable : Quality::kCaution);
  }
}

TEST(Quality, OnlyFinalUpdatesJudgedGoodOrWithCautionAreUsable) {
  Update update;
  EXPECT_FALSE(update.usable()) << "nobody has judged it";
  for (const Quality quality :
       {Quality::kNotJudged, Quality::kGood, Quality::kCaution, Quality::kUnusable}) {
    update.estimate.quality.quality = quality;
    update.final = true;
    EXPECT_EQ(update.usable(), quality == Quality::kGood || quality == Quality::kCaution);
    update.final = false;
    EXPECT_FALSE(update.usable());
  }
}

}  // namespace
}  // namespace brainshift
