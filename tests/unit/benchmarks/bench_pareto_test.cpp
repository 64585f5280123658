// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/pareto.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/core/random.hpp"

namespace brainshift::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ParetoFront, IsWhatNoOtherPointBeats) {
  EXPECT_THAT(pareto_front({}), IsEmpty());
  EXPECT_THAT(pareto_front({{3, 1}, {1, 3}, {2, 2}, {3, 3}, {2, 4}}), ElementsAre(1, 2, 0));
  EXPECT_THAT(pareto_front({{1, 1}, {1, 1}, {1, 2}, {2, 1}}), ElementsAre(0)) << "ties";
}

TEST(ParetoFront, LeavesOutWhatIsNotFinite) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_THAT(pareto_front({{none, 0}, {0, none}, {-infinite, 1}, {1, 1}}), ElementsAre(3));
}

TEST(ParetoFront, AgreesWithTheDefinitionOnRandomPoints) {
  Random random(11);
  std::vector<std::pair<double, double>> points;
  for (int i = 0; i < 200; ++i) points.emplace_back(random.uniform(), random.uniform());
  std::vector<std::size_t> expected;
  for (std::size_t i = 0; i < points.size(); ++i) {
    bool beaten = false;
    for (const auto& other : points) {
      beaten = beaten || (other.first <= points[i].first && other.second <= points[i].second &&
                          other != points[i]);
    }
    if (!beaten) expected.push_back(i);
  }
  ASSERT_GT(expected.size(), 2u);
  EXPECT_THAT(pareto_front(points), ::testing::UnorderedElementsAreArray(expected));
}

}  // namespace
}  // namespace brainshift::bench
