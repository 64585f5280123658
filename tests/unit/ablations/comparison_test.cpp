// SPDX-License-Identifier: GPL-3.0-or-later
// Differences on tables made by hand.
#include "tests/ablations/comparison.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/ablations/ablation_truths.hpp"
#include "tests/unit/ablations/made_up_rows.hpp"

namespace brainshift::ablations {
namespace {

const Difference* find(const std::vector<Difference>& all, const std::string& measure,
                       const std::string& group, const std::string& data) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Difference& one) {
    return one.measure == measure && one.group == group && one.data == data;
  });
  return found == all.end() ? nullptr : &*found;
}

TEST(Differences, PairTheSameSurgeryAndTheSameData) {
  MadeUpRows rows;
  rows.add("default", "mesh", "tumour", 1, 1.0);
  rows.add("default", "mesh", "tumour+cortex", 1, 0.5);
  rows.add("default", "gap", "tumour", 2, 2.0);
  rows.add("default", "gap", "tumour", 3, 100.0);  // the variant has none
  rows.add("fixed", "mesh", "tumour", 1, 1.5);
  rows.add("fixed", "mesh", "tumour+cortex", 1, 0.75);
  rows.add("fixed", "gap", "tumour", 2, 4.0);
  const auto table = rows.table();
  const auto all = differences(surgeries::Rows(table), *find_part("fixed"));
  const Difference* alone = find(all, "tumour", "one ingredient", "tumour alone");
  ASSERT_NE(alone, nullptr);
  EXPECT_EQ(alone->pairs, 2);
  EXPECT_NEAR(alone->of_default, std::sqrt(1.0 * 2.0), 1e-12);  // geometric means
  EXPECT_NEAR(alone->of_variant, std::sqrt(1.5 * 4.0), 1e-12);
  EXPECT_NEAR(alone->change(), std::sqrt(3.0) - 1.0, 1e-12);
  const Difference* last = find(all, "tumour", kEverything, "all data");
  ASSERT_NE(last, nullptr);
  EXPECT_NEAR(last->of_default, std::sqrt(0.5 * 2.0),
              1e-12);  // of gap the tumour alone is the last
  EXPECT_EQ(find(all, "tumour", "resection", "all data"), nullptr);
}

TEST(Differences, LeaveOutRefusedUpdates) {
  MadeUpRows rows;
  for (const int seed : {1, 2, 3}) {
    rows.add("default", "mesh", "tumour", seed, 1.0);
    if (seed == 2) {
      rows.add_refused("fixed", "mesh", seed);
    } else {
      rows.add("fixed", "mesh", "tumour", seed, 2.0);
    }
  }
  const auto table = rows.table();
  const auto all = differences(surgeries::Rows(table), *find_part("fixed"));
  EXPECT_EQ(find(all, "tumour", kEverything, "tumour alone")->pairs, 2);
}

TEST(Differences, AnUpdateWithLessDataIsHeldAgainstTheLastOne) {
  MadeUpRows rows;
  for (const int seed : {1, 2}) {
    rows.add("default", "mesh", "tumour", seed, 1.0);
    rows.add("default", "mesh", "tumour+cortex", seed, 0.25);
    rows.add("no-cortex", "mesh", "tumour", seed, 1.0);
  }
  const auto table = rows.table();
  const auto all = differences(surgeries::Rows(table), *find_part("no-cortex"));
  EXPECT_NEAR(find(all, "tumour", kEverything, "all data")->change(), 3.0, 1e-12);
  EXPECT_NEAR(find(all, "tumour", kEverything, "tumour alone")->change(), 0.0, 1e-12);
}

TEST(Differences, CountWhenTheyAreBothSureAndLarge) {
  MadeUpRows rows;
  for (int seed = 1; seed <= 8; ++seed) {
    const double noise = 1e-4 * seed;
    rows.add("default", "mesh", "tumour", seed, 1.0);
    rows.add("fixed", "mesh", "tumour", seed, 1.01 + noise);          // sure, and 1 %
    rows.add("no-medium", "mesh", "tumour", seed, 1.5 + noise);       // sure, and 50 %
    rows.add("low-rank", "mesh", "tumour", seed, seed == 8 ? 9 : 1);  // 100 %, by one surgery
  }
  const auto table = rows.table();
  const surgeries::Rows all(table);
  const auto counts = [&](const char* variant) {
    return find(differences(all, *find_part(variant)), "tumour", kEverything, "tumour alone")
        ->counts;
  };
  EXPECT_FALSE(counts("fixed"));
  EXPECT_TRUE(counts("no-medium"));
  EXPECT_FALSE(counts("low-rank"));
}

TEST(Differences, OfTheIntervalAreDeparturesFromNineTenths) {
  MadeUpRows rows;
  for (const int seed : {1, 2}) {
    rows.add("default", "mesh", "tumour", seed, 1.0, 0.88);
    rows.add("fixed", "mesh", "tumour", seed, 1.0, 0.97);
  }
  const auto table = rows.table();
  const auto all = differences(surgeries::Rows(table), *find_part("fixed"));
  EXPECT_NEAR(find(all, "interval", kEverything, "tumour alone")->change(), 0.05, 1e-12);
}

Difference counting(double of_default, double of_variant) {
  return {"tumour", "mm", "mesh", "all data", 9, of_default, of_variant, 1e-9, true};
}

TEST(Balance, APartBuysWhatIsWorseWithoutIt) {
  Difference chance = counting(1.0, 5.0);
  chance.counts = false;
  const auto found = balance({counting(1.0, 1.5), counting(1.0, 3.0), counting(1.0, 0.5), chance},
                             *find_part("fixed"));
  ASSERT_EQ(found.buys.size(), 2u);
  EXPECT_DOUBLE_EQ(found.buys[0].of_variant, 3.0);  // the largest first
  ASSERT_EQ(found.costs.size(), 1u);
}

TEST(Balance, APartThatWasAddedBuysWhatIsBetterWithIt) {
  const auto found = balance({counting(1.0, 1.5), counting(1.0, 0.5)}, *find_part("refined"));
  ASSERT_EQ(found.buys.size(), 1u);
  EXPECT_DOUBLE_EQ(found.buys[0].of_variant, 0.5);
}

}  // namespace
}  // namespace brainshift::ablations
