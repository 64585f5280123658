// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/invert.hpp"

#include <gmock/gmock.h>

#include "common/inversion/inverter.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

CaseConfig config() {
  CaseConfig config = test_support::toy_config();
  config.condensed.max_rank = 60;
  config.condensed.uncertainty_nodes = 40;
  return config;
}

// The one-shot is the inverter's first update, bit for bit; by default of method condensed.
TEST(Invert, EqualsTheFirstUpdateOfAnInverterForEveryMethod) {
  const auto model = std::make_shared<const PreparedModel>(prepare(Boundary::kContact, config()));
  const SparseData data = sagging_data(*model, 0.1);
  for (const Method method : kAllMethods) {
    const auto once = invert(*model, data, method);
    ASSERT_TRUE(once.has_value()) << to_string(method) << ": " << once.error().message;
    Estimate estimate;
    ASSERT_TRUE((*make_inverter(model, method))->update(data, {}, estimate));
    EXPECT_TRUE(once->displacement == estimate.displacement) << to_string(method);
    EXPECT_EQ(once->reason, estimate.reason) << to_string(method);
  }
  const auto by_default = invert(*model, data);
  ASSERT_TRUE(by_default.has_value());
  EXPECT_EQ(by_default->sd_mm.size(), patient()->mesh.num_nodes()) << "method condensed has sd";
}

TEST(Invert, ChecksTheDataBeforeItPrepares) {
  CaseConfig small = config();
  small.condensed.memory_limit_gib = 1e-6;  // any preparation would fail
  const PreparedModel model = prepare(Boundary::kContact, small);
  const SparseData good = sagging_data(model, 0.1);
  const auto few = invert(
      model, {good.positions.leftCols(2), good.displacements.leftCols(2), good.sd_mm.head(2)});
  ASSERT_FALSE(few.has_value());
  EXPECT_THAT(few.error().message, testing::HasSubstr("2 points"));
  const auto large = invert(model, good);
  ASSERT_FALSE(large.has_value());
  EXPECT_THAT(large.error().message, testing::HasSubstr("memory_limit_gib"));
}

TEST(Invert, CanBeStoppedWhileItPrepares) {
  const PreparedModel model = prepare(Boundary::kContact, config());
  std::stop_source source;
  source.request_stop();
  InversionOptions options;
  options.stop = source.get_token();
  const auto stopped = invert(model, sagging_data(model, 0.1), Method::kCondensed, options);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace brainshift::inversion
