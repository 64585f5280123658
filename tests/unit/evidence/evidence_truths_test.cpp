// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/patient_twin.hpp"

#include <gtest/gtest.h>

namespace brainshift::evidence {
namespace {

TEST(TruthKinds, AreConsistencyEachIngredientAllAndAnotherCode) {
  ASSERT_EQ(truth_kinds().size(), client::all_ingredients().size() + 3);
  EXPECT_TRUE(truth_kinds().front().ingredients.empty());
  EXPECT_EQ(find_truth("gap")->ingredients.size(), 1u);
  EXPECT_EQ(find_truth("all")->ingredients.size(), client::all_ingredients().size());
  EXPECT_TRUE(find_truth("calculix")->calculix);
  EXPECT_EQ(find_truth("weather"), nullptr);
}

}  // namespace
}  // namespace brainshift::evidence
