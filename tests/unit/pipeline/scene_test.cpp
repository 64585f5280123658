// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/scene.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::pipeline {
namespace {

using testing::HasSubstr;

void expect_refused(const CaseConfig& config, Method method, Boundary boundary,
                    const std::string& words) {
  EXPECT_THAT(refusal_of(plan_scene(config, method, boundary), ErrorCode::kInvalidArgument),
              HasSubstr(words));
}

TEST(PlanScene, CarriesEverythingByDefault) {
  const auto plan = value_or_fail(plan_scene({}, Method::kCondensed, Boundary::kContact));
  EXPECT_TRUE(plan.contact && plan.uncertainty && plan.gravity_modes && plan.far_field);
}

TEST(PlanScene, DefaultsAreAllowedWithEveryMethodAndBoundary) {
  for (const Method method : kAllMethods) {
    for (const Boundary boundary : {Boundary::kContact, Boundary::kFixed}) {
      const auto plan = plan_scene({}, method, boundary);
      ASSERT_TRUE(plan.has_value()) << to_string(method);
      EXPECT_EQ(plan->contact, boundary == Boundary::kContact);
      EXPECT_EQ(plan->uncertainty, method == Method::kCondensed);
    }
  }
}

TEST(PlanScene, LeavesOutWhatIsForcedOff) {
  CaseConfig config;
  config.scene.contact = Carry::kOff;
  config.scene.uncertainty = Carry::kOff;
  config.scene.gravity_modes = Carry::kOff;
  config.scene.far_field = Carry::kOff;
  const auto plan = value_or_fail(plan_scene(config, Method::kCondensed, Boundary::kContact));
  EXPECT_FALSE(plan.contact || plan.uncertainty || plan.gravity_modes || plan.far_field);
}

TEST(PlanScene, CarriesWhatIsForcedOn) {
  CaseConfig config;
  config.scene.contact = config.scene.uncertainty = config.scene.gravity_modes =
      config.scene.far_field = config.scene.rotation = Carry::kOn;
  const auto plan = value_or_fail(plan_scene(config, Method::kCondensed, Boundary::kContact));
  EXPECT_TRUE(plan.contact && plan.uncertainty && plan.gravity_modes && plan.far_field);
}

TEST(PlanScene, CarriesPressureOnlyWhenAsked) {
  CaseConfig config;
  EXPECT_FALSE(plan_scene(config, Method::kCondensed, Boundary::kContact)->pressure);
  config.scene.pressure = Carry::kOn;
  for (const Method method : {Method::kCondensed, Method::kPaper}) {
    EXPECT_TRUE(plan_scene(config, method, Boundary::kContact)->pressure);
    EXPECT_TRUE(plan_scene(config, method, Boundary::kFixed)->pressure);
  }
}

TEST(PlanScene, APriorWithoutGravityModesHasNoneToCarry) {
  CaseConfig config;
  config.prior.gravity_mode_sd = 0.0;
  EXPECT_FALSE(plan_scene(config, Method::kCondensed, Boundary::kContact)->gravity_modes);
}

TEST(PlanScene, RefusesPartsForcedOnThatAreNotAvailable) {
  CaseConfig config;
  config.scene.pressure = Carry::kOn;
  expect_refused(config, Method::kIterativeSolver, Boundary::kContact,
                 "scene.pressure = on: method pcg has no solver for pore pressure");
  config = {};
  config.scene.contact = Carry::kOn;
  expect_refused(config, Method::kCondensed, Boundary::kFixed, "scene.contact = on");
  config = {};
  config.scene.uncertainty = Carry::kOn;
  expect_refused(config, Method::kPaper, Boundary::kContact, "method paper");
  config = {};
  config.scene.gravity_modes = Carry::kOn;
  config.prior.gravity_levels_mm.clear();
  expect_refused(config, Method::kCondensed, Boundary::kContact, "scene.gravity_modes = on");
}

TEST(PlanScene, RefusesPartsForcedOffThatTheMethodAlwaysCarries) {
  CaseConfig config;
  config.scene.contact = Carry::kOff;
  expect_refused(config, Method::kPaper, Boundary::kContact, "scene.contact = off");
  EXPECT_TRUE(plan_scene(config, Method::kPaper, Boundary::kFixed).has_value());
  config = {};
  config.scene.gravity_modes = Carry::kOff;
  expect_refused(config, Method::kPaper, Boundary::kContact, "scene.gravity_modes = off");
}

TEST(PriorOmissions, ListsThePartsOfThePriorThatTheCaseSwitchesOff) {
  PriorConfig prior;
  prior.force_density_sd_n_m3 = prior.medium_density_sd_n_m3;
  prior.gravity_direction_sd_deg = 10.0;
  prior.resection_weight_sd = 1.0;
  prior.resection_stress_sd_pa = 300.0;
  EXPECT_TRUE(prior_omissions(prior).empty());
  prior.tumour_volume_strain_sd = 0.0;
  prior.gravity_levels_mm.clear();
  prior.resection_weight_sd = 0.0;  // its stress stays
  const auto left_out = prior_omissions(prior);
  ASSERT_EQ(left_out.size(), 2u);
  EXPECT_EQ(left_out[0].part, "gravity modes");
  EXPECT_EQ(left_out[1].part, "swelling of the tumour");
  EXPECT_THAT(left_out[1].reason, HasSubstr("prior.tumour_volume_strain_sd"));
  EXPECT_THAT(left_out[1].estimated_error, HasSubstr("1.7 mm at the cortex"));
  prior.resection_stress_sd_pa = 0.0;
  EXPECT_EQ(prior_omissions(prior).size(), 3u);
}

// By default other parts stand for three; without those these are missing.
TEST(PriorOmissions, SaysThatAnotherPartTakesThePlaceOfOneThatIsOff) {
  PriorConfig prior;
  const auto by_default = prior_omissions(prior);
  ASSERT_EQ(by_default.size(), 3u);
  EXPECT_EQ(by_default[0].part, "buoyancy across gravity");
  EXPECT_THAT(by_default[0].estimated_error,
              HasSubstr("the coarse residual field takes its place"));
  EXPECT_EQ(by_default[1].part, "resection");
  EXPECT_THAT(by_default[1].estimated_error, HasSubstr("swelling of the tumour takes its place"));
  EXPECT_EQ(by_default[2].part, "fine residual field");
  EXPECT_THAT(by_default[2].estimated_error,
              HasSubstr("the medium residual field takes its place"));
  prior.medium_density_sd_n_m3 = 0.0;
  const auto none = prior_omissions(prior);
  ASSERT_EQ(none.size(), 4u);
  EXPECT_EQ(none[2].part, "fine residual field");
  EXPECT_THAT(none[2].estimated_error, HasSubstr("0.1 mm at the cortex"));
}

TEST(RegionOfInterest, IsTheNodesNoFartherFromTheTumourThanAsked) {
  const BrainModel model = test_support::toy_patient(6);
  const auto region = region_of_interest(model, 12.0);
  EXPECT_TRUE(std::is_sorted(region.begin(), region.end()));
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    const double distance = (model.mesh.nodes.col(i) - Vec3(30, 30, 40)).norm() - 10.0;
    if (std::abs(distance - 12.0) < 1.0) continue;  // facets of the ball
    EXPECT_EQ(std::binary_search(region.begin(), region.end(), i), distance < 12.0) << i;
  }
}

TEST(RegionOfInterest, IsEmptyWithoutATumourSurface) {
  BrainModel model = test_support::toy_patient();
  model.tumour = {};
  EXPECT_TRUE(region_of_interest(model, 12.0).empty());
}

}  // namespace
}  // namespace brainshift::pipeline
