// SPDX-License-Identifier: Apache-2.0
#include <algorithm>  // IWYU: random.hpp relies on it

#include "common/core/random.hpp"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "common/core/statistics.hpp"

namespace brainshift {
namespace {

constexpr int kSamples = 20000;

TEST(Random, SameSeedGivesTheSameNumbersAndAnotherOthers) {
  Random first(7);
  Random second(7);
  Random other(8);
  int equal = 0;
  for (int i = 0; i < 100; ++i) {
    const double x = first.normal();
    EXPECT_EQ(x, second.normal());
    equal += x == other.normal() ? 1 : 0;
  }
  EXPECT_EQ(equal, 0);
}

// The C++ standard fixes the generator (10000th output of the default seed), so recorded
// surgeries can be made again on any machine.
TEST(Random, UniformIsTheGeneratorsTop53Bits) {
  Random random(5489);
  double last = 0.0;
  for (int i = 0; i < 10000; ++i) last = random.uniform();
  EXPECT_EQ(last, static_cast<double>(9981545732273789042ull >> 11) / 9007199254740992.0);
}

// Tolerances: five standard errors of the mean, 5 / sqrt(20000) = 0.035, and of the spread,
// 0.025.
TEST(Random, NormalHasMeanZeroAndSpreadOne) {
  Random random(1);
  std::vector<double> values(kSamples);
  for (double& value : values) value = random.normal();
  EXPECT_NEAR(mean_std(values).mean, 0.0, 0.035);
  EXPECT_NEAR(mean_std(values).std, 1.0, 0.025);
  EXPECT_NEAR(percentile(values, 97.5), 1.96, 0.1);
}

TEST(Random, DirectionsAreUnitVectorsWithoutPreference) {
  Random random(2);
  Mat3 second_moment = Mat3::Zero();
  Vec3 mean = Vec3::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 d = random.direction();
    EXPECT_NEAR(d.norm(), 1.0, 1e-12);
    mean += d / kSamples;
    second_moment += d * d.transpose() / kSamples;
  }
  EXPECT_LT(mean.norm(), 0.035);
  // Isotropic: E[d d^T] = I / 3.
  EXPECT_LT((second_moment - Mat3::Identity() / 3.0).cwiseAbs().maxCoeff(), 0.02);
}

TEST(Random, IndexReachesEveryValueBelowTheCount) {
  Random random(3);
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t index = random.index(10);
    ASSERT_LT(index, 10u);
    seen.insert(index);
  }
  EXPECT_EQ(seen.size(), 10u);
}

TEST(Random, ChoosesDistinctIndices) {
  Random random(4);
  const std::vector<int> chosen = random.choose(200, 2541);
  EXPECT_EQ(std::set<int>(chosen.begin(), chosen.end()).size(), 200u);
  EXPECT_GE(*std::min_element(chosen.begin(), chosen.end()), 0);
  EXPECT_LT(*std::max_element(chosen.begin(), chosen.end()), 2541);
}

TEST(Random, ChoosesAllWhenAskedForMoreThanThereAre) {
  Random random(5);
  std::vector<int> chosen = random.choose(10, 4);
  std::sort(chosen.begin(), chosen.end());
  EXPECT_EQ(chosen, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_TRUE(random.choose(5, 0).empty());
}

TEST(Random, EveryIndexIsChosenEquallyOften) {
  Random random(6);
  std::vector<int> counts(10, 0);
  for (int i = 0; i < 5000; ++i) {
    for (const int index : random.choose(3, 10)) ++counts[static_cast<std::size_t>(index)];
  }
  // Binomial with n = 5000, p = 0.3: mean 1500, standard deviation 32; five of them.
  for (const int count : counts) EXPECT_NEAR(count, 1500, 162);
}

}  // namespace
}  // namespace brainshift
