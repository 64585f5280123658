// SPDX-License-Identifier: GPL-3.0-or-later
// What every inverter owes its caller, whatever its method.
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <string>

#include "common/inversion/inverter.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

using testing::HasSubstr;

class Inverters : public ::testing::TestWithParam<Method> {
 protected:
  static std::shared_ptr<const PreparedModel> model() {
    static const auto shared =
        std::make_shared<const PreparedModel>(prepare(Boundary::kContact, config()));
    return shared;
  }
  static CaseConfig config() {
    CaseConfig config = test_support::toy_config();
    config.condensed.max_rank = 60;
    config.condensed.uncertainty_nodes = 40;
    return config;
  }
  // At nodes of the data region.
  static SparseData data() {
    const SparseData sampled = sagging_data(*model(), 0.1);
    const auto region = data_region(*patient());
    SparseData data;
    data.positions = patient()->mesh.nodes(Eigen::all, region);
    data.displacements = Points(3, data.positions.cols());
    for (Eigen::Index i = 0; i < data.positions.cols(); ++i) {
      Eigen::Index nearest = 0;
      (sampled.positions.colwise() - data.positions.col(i)).colwise().norm().minCoeff(&nearest);
      data.displacements.col(i) = sampled.displacements.col(nearest);
    }
    data.sd_mm = VecX::Constant(data.positions.cols(), 0.5);
    return data;
  }
  static std::unique_ptr<Inverter> inverter() {
    return value_or_fail(make_inverter(model(), GetParam()));
  }
};

INSTANTIATE_TEST_SUITE_P(Methods, Inverters, ::testing::ValuesIn(kAllMethods),
                         [](const auto& each) {
                           std::string name(to_string(each.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(Inverters, FillEveryMemberOfAnEstimateThatHeldAnother) {
  auto made = inverter();
  Estimate fresh, used;
  ASSERT_TRUE(made->update(data(), {}, fresh));
  EXPECT_NE(fresh.status, EstimateStatus::kNotRun);
  EXPECT_FALSE(fresh.reason.empty());
  EXPECT_FALSE(std::isnan(fresh.min_volume_ratio));
  EXPECT_FALSE(std::isnan(fresh.min_nodal_volume_ratio));
  EXPECT_GT(made->bytes(), 0u);
  EXPECT_EQ(made->omission_errors().has_value(), GetParam() == Method::kCondensed);
  // Somebody else's numbers must not shine through.
  used.prior_scales.fill(7.0);
  used.sources.resize(3);
  used.sd_mm = VecX::Ones(5);
  used.active_slaves = {1, 2, 3};
  used.history.resize(9);
  used.rebuild_ms = -1.0;
  made->reset();
  ASSERT_TRUE(made->update(data(), {}, used));
  EXPECT_EQ(used.prior_scales, fresh.prior_scales);
  EXPECT_EQ(used.sources.size(), fresh.sources.size());
  EXPECT_EQ(used.sd_mm.size(), fresh.sd_mm.size());
  EXPECT_EQ(used.active_slaves, fresh.active_slaves);
  EXPECT_EQ(used.history.size(), fresh.history.size());
  EXPECT_GE(used.rebuild_ms, 0.0);
  EXPECT_TRUE(used.displacement == fresh.displacement) << "reset() did not forget";
}

TEST_P(Inverters, JudgeTheirEstimate) {
  auto made = inverter();
  Estimate estimate;
  estimate.quality.reason = "somebody else's";
  estimate.quality.flags.set(QualityFlag::kNotFinite);
  ASSERT_TRUE(made->update(data(), {}, estimate));
  EXPECT_TRUE(estimate.quality.usable()) << estimate.quality.reason;
  EXPECT_EQ(estimate.quality.quality, estimate.quality.flags.quality());
  EXPECT_EQ(estimate.quality.reason.empty(), estimate.quality.flags.empty());
}

// Neighbours that are asked to change places, within what check_data lets pass.
TEST_F(Inverters, ForgetAnUnusableEstimate) {
  const auto made = value_or_fail(make_inverter(model(), Method::kCondensed));
  Estimate cold, unusable, after;
  ASSERT_TRUE(made->update(data(), {}, cold));
  SparseData torn = data();
  for (Eigen::Index i = 0; i < torn.positions.cols(); ++i) {
    torn.displacements.col(i) = Vec3(i % 2 == 0 ? 9.0 : -9.0, 0.0, 0.0);
  }
  torn.sd_mm.setConstant(1e-3);
  ASSERT_TRUE(made->update(torn, {}, unusable));
  ASSERT_EQ(unusable.quality.quality, Quality::kUnusable);
  EXPECT_TRUE(unusable.quality.flags.has(QualityFlag::kInvertedElements));
  ASSERT_TRUE(made->update(data(), {}, after));
  EXPECT_TRUE(after.quality.usable());
  EXPECT_EQ(after.history.size(), cold.history.size());
  EXPECT_TRUE(after.displacement == cold.displacement) << "the next update began from it";
}

TEST_P(Inverters, AStopEndsTheUpdateWithItsOwnReason) {
  auto made = inverter();
  std::stop_source source;
  source.request_stop();
  InversionOptions asked;
  asked.stop = source.get_token();
  Estimate estimate;
  EXPECT_EQ(sentence_of(made->update(data(), asked, estimate)),
            "inversion was stopped at iteration 1");
  EXPECT_TRUE(made->update(data(), {}, estimate)) << "the next update must work";
}

TEST_P(Inverters, RejectDataThatAreNotFiniteOrOutsideTheBrain) {
  auto made = inverter();
  SparseData bad = data(), outside = data();
  bad.displacements(1, 3) = std::numeric_limits<double>::quiet_NaN();
  outside.positions.col(2) = Vec3(30, 30, 90);
  Estimate estimate;
  EXPECT_THAT(refusal_of(made->update(bad, {}, estimate), ErrorCode::kNotFinite),
              HasSubstr("point 3"));
  EXPECT_THAT(refusal_of(made->update(outside, {}, estimate), ErrorCode::kInvalidArgument),
              HasSubstr("point 2"));
}

TEST_P(Inverters, OnlyMethodCondensedTakesDataAlongADirection) {
  auto made = inverter();
  SparseData along = data();
  along.directions = Points::Zero(3, along.size());
  along.directions.col(2) = Vec3::UnitZ();
  Estimate estimate;
  EXPECT_EQ(made->update(along, {}, estimate).has_value(), GetParam() == Method::kCondensed);
}

TEST_F(Inverters, CondensedOverGivenOperatorsIsTheOneThatCondenses) {
  auto operators = std::make_shared<const CondensedOperators>(std::move(*condense(*model())));
  const auto given = value_or_fail(condensed_inverter(
      operators, std::make_shared<const geometry::TetLocator>(patient()->mesh), config()));
  EXPECT_EQ(given->bytes(), operators->bytes());
  const auto made = value_or_fail(make_inverter(model(), Method::kCondensed));
  Estimate a, b;
  ASSERT_TRUE(given->update(data(), {}, a));
  ASSERT_TRUE(made->update(data(), {}, b));
  EXPECT_TRUE(a.displacement == b.displacement);
}

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
  const auto by_default = value_or_fail(invert(*model, data));
  EXPECT_EQ(by_default.sd_mm.size(), patient()->mesh.num_nodes()) << "method condensed has sd";
}

TEST(Invert, ChecksTheDataBeforeItPrepares) {
  CaseConfig small = config();
  small.condensed.memory_limit_gib = 1e-6;  // any preparation would fail
  const PreparedModel model = prepare(Boundary::kContact, small);
  const SparseData good = sagging_data(model, 0.1);
  EXPECT_THAT(sentence_of(invert(model, {good.positions.leftCols(2), good.displacements.leftCols(2),
                                         good.sd_mm.head(2)})),
              testing::HasSubstr("2 points"));
  EXPECT_THAT(sentence_of(invert(model, good)), testing::HasSubstr("memory_limit_gib"));
}

TEST(Invert, CanBeStoppedWhileItPrepares) {
  const PreparedModel model = prepare(Boundary::kContact, config());
  std::stop_source source;
  source.request_stop();
  InversionOptions options;
  options.stop = source.get_token();
  refusal_of(invert(model, sagging_data(model, 0.1), Method::kCondensed, options),
             ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace brainshift::inversion
