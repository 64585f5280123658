// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/prepared_model.hpp"

#include <set>
#include <string>

#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

TEST(PreparedModel, HoldsWhatItWasMadeFromAndItsTimes) {
  std::set<std::string> stages;
  CaseConfig config = test_support::toy_config();
  const std::vector<double> levels = config.prior.gravity_levels_mm;
  config.prior = {};  // every part:
  config.prior.gravity_direction_sd_deg = 10.0;
  config.prior.resection_weight_sd = 1.0;
  config.prior.resection_stress_sd_pa = 300.0;
  config.prior.gravity_levels_mm = levels;
  const auto model =
      PreparedModel::prepare(patient(), config, Boundary::kFixed,
                             [&](std::string_view stage, double) { stages.emplace(stage); });
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(model->boundary(), Boundary::kFixed);
  EXPECT_EQ(&model->model(), patient().get());
  // Fluid levels in three directions, bumps of three radii, the brain's halves, resection, opening.
  EXPECT_EQ(model->prior().num_modes(), 6 + (27 + 27 + 7) + 4 + 9 + 21);
  EXPECT_GT(model->timings().factor_nonzeros, 0u);
  EXPECT_GT(model->timings().bytes, 0u);
  EXPECT_GE(model->timings().total_s, model->timings().factor_s);
  EXPECT_EQ(stages.count("prior"), 1u);
  EXPECT_EQ(stages.count("ready"), 1u);
}

TEST(PreparedModel, ABodyThatFloatsIsNamed) {
  auto floating = std::make_shared<BrainModel>(*patient());
  floating->fixed.clear();
  const auto model =
      PreparedModel::prepare(floating, test_support::toy_config(), Boundary::kContact);
  ASSERT_FALSE(model.has_value());
  EXPECT_EQ(model.error().code, ErrorCode::kFloatingBody) << model.error().message;
}

PriorScaleValues all(double value) {
  PriorScaleValues scales;
  scales.fill(value);
  return scales;
}

// The scales multiply standard deviations: twice the scale of all parts is four times the
// covariance.
TEST(ScaledPrior, MultipliesTheStandardDeviationOfEveryPart) {
  const PreparedModel model = prepare(Boundary::kContact);
  const Points load = Points::Ones(3, patient()->mesh.num_nodes());
  const Points once = model.prior().apply(load);
  const Points twice = scaled_prior(model, all(2.0)).apply(load);
  ASSERT_GT(once.norm(), 0.0);
  EXPECT_LT((twice - 4.0 * once).norm(), 1e-12 * twice.norm());
  const Points without = scaled_prior(model, all(0.0)).apply(load);
  EXPECT_EQ(without.norm(), 0.0);
}

}  // namespace
}  // namespace brainshift::inversion
