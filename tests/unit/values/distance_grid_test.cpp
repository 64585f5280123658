// SPDX-License-Identifier: Apache-2.0
#include "common/values/distance_grid.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/results.hpp"

namespace brainshift {
namespace {

DistanceGrid grid() {
  DistanceGrid grid;
  grid.origin_mm = Vec3(1, 2, 3);
  grid.spacing_mm = 0.5;
  grid.dims = {2, 3, 4};
  grid.values.assign(24, 1.0f);
  return grid;
}

TEST(DistanceGrid, FirstAxisRunsFastest) {
  EXPECT_EQ(grid().num_nodes(), 24u);
  EXPECT_EQ(grid().index(1, 0, 0), 1u);
  EXPECT_EQ(grid().index(0, 1, 0), 2u);
  EXPECT_EQ(grid().index(1, 2, 3), 23u);
  EXPECT_EQ(grid().node(1, 2, 3), Vec3(1.5, 3.0, 4.5));
}

TEST(DistanceGrid, EmptyAndWholeOnesAreValid) {
  EXPECT_TRUE(validate(DistanceGrid{}).has_value());
  EXPECT_TRUE(validate(grid()).has_value());
}

TEST(DistanceGrid, InvalidOnesNameWhatIsWrong) {
  const auto message = [](ErrorCode code, auto change) {
    DistanceGrid bad = grid();
    change(bad);
    return refusal_of(validate(bad), code);
  };
  const auto contains = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  const auto invalid = ErrorCode::kInvalidArgument;
  EXPECT_TRUE(contains(message(invalid, [](auto& g) { g.dims = {1, 6, 4}; }), "1 x 6 x 4 nodes"));
  EXPECT_TRUE(contains(message(invalid, [](auto& g) { g.values.pop_back(); }), "23 values"));
  EXPECT_TRUE(contains(message(invalid, [](auto& g) { g.values.clear(); }), "0 values"));
  EXPECT_TRUE(contains(message(invalid, [](auto& g) { g.spacing_mm = 0.0; }), "spacing_mm = 0"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(contains(message(invalid, [nan](auto& g) { g.spacing_mm = nan; }), "spacing_mm"));
  EXPECT_TRUE(contains(message(ErrorCode::kNotFinite, [nan](auto& g) { g.origin_mm[1] = nan; }),
                       "origin_mm is not finite"));
  EXPECT_TRUE(contains(
      message(ErrorCode::kNotFinite, [nan](auto& g) { g.values[7] = static_cast<float>(nan); }),
      "value 7 is not finite"));
}

}  // namespace
}  // namespace brainshift
