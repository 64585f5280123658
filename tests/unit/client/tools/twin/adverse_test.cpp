// SPDX-License-Identifier: GPL-3.0-or-later
// Adverse ingredients on the toy patient, all but the other mesh (truth_brain_test.cpp).
#include "client/tools/twin/adverse.hpp"

#include <gmock/gmock.h>

#include <numbers>

#include "client/tools/twin/measure.hpp"
#include "client/tools/twin/surgery.hpp"
#include "client/tools/twin/truth_load.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

// The toy patient with its head a little to the side, so that gravity can turn and tilt.
const BrainModel& adverse_patient() {
  static const BrainModel model = [] {
    BrainModel toy = test_support::toy_patient(6);
    toy.gravity_direction = Vec3(0.6, 0, -1).normalized();
    const Points nodes = toy.mesh.nodes(Eigen::all, toy.craniotomy);
    toy.fluid_plane_depth_mm = (toy.gravity_direction.transpose() * nodes).maxCoeff();
    return toy;
  }();
  return model;
}

// Swelling that presses on the skull while half of the brain is out of the fluid; ultrasound and
// a camera.
Scenario pressed() {
  Scenario scenario = *find_scenario("joint-distension");
  scenario.fluid_levels_mm = {20.0};
  scenario.swelling = {0.5, 42.0, 9.0};
  scenario.stiffness_sd = 0.0;
  scenario.cortex->tracks = 5;
  return scenario;
}

Result<SimulatedSurgery> play(const Ingredients& ingredients, std::uint64_t seed = 1,
                              const Scenario& scenario = pressed()) {
  const auto adverse =
      with_ingredients(scenario, ingredients, adverse_patient().gravity_direction, seed);
  if (!adverse) return tl::unexpected(adverse.error());
  return play_scenario(adverse_patient(), test_support::toy_config(), *adverse, 1);
}

const Points& boundary_of(const SimulatedSurgery& surgery) {
  return std::get<TumourBoundary>(surgery.observations[0].body).points;
}

Ingredients all_but_mesh() {
  Ingredients ingredients = *ingredients_from("all");
  ingredients.erase(Ingredient::kMesh);
  return ingredients;
}

TEST(Ingredients, AreNamedOnceAndNamesAreRead) {
  std::set<std::string> names;
  std::string list;
  for (const IngredientInfo& info : all_ingredients()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.description.empty());
    const auto alone = value_or_fail(ingredients_from(info.name));
    EXPECT_EQ(alone, Ingredients{info.ingredient});
    EXPECT_EQ(name_of(alone), info.name);
    list += (list.empty() ? "" : ",") + info.name;
  }
  EXPECT_EQ(list,
            "mesh,gap,penalty,stiffness,level,gravity,tracker,calibration,segmentation,"
            "partial-sweep");
  EXPECT_EQ(*ingredients_from("all"), *ingredients_from(list));
  EXPECT_EQ(name_of(*ingredients_from("all")), "all");
  EXPECT_EQ(name_of(*ingredients_from("level,gap")), "gap+level");
  EXPECT_EQ(name_of({}), "");
}

TEST(Ingredients, UnknownRepeatedAndMissingNamesAreRefused) {
  EXPECT_THAT(refusal_of(ingredients_from("gap,weather"), ErrorCode::kNotFound),
              testing::AllOf(HasSubstr("\"weather\""), HasSubstr("partial-sweep")));
  EXPECT_EQ(ingredients_from("gap,gap").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(ingredients_from("gap,").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(ingredients_from("").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(ingredients_from("gap,all").error().code, ErrorCode::kNotFound);
}

// Ingredients of the brain change the truth; those of the instruments change what is measured and
// leave the truth alone. The case's own nodes carry the truth in either case.
TEST(Ingredients, EachChangesWhatItIsNamedAfter) {
  const auto plain = value_or_fail(play({}));
  const std::set<Ingredient> of_the_brain = {Ingredient::kGap, Ingredient::kPenalty,
                                             Ingredient::kStiffness, Ingredient::kLevel,
                                             Ingredient::kGravity};
  for (const Ingredient ingredient : all_but_mesh()) {
    const auto adverse = play({ingredient});
    ASSERT_TRUE(adverse) << name_of({ingredient}) << ": " << adverse.error().message;
    const Points& truth = adverse->truths[0].displacement;
    ASSERT_EQ(truth.cols(), adverse_patient().mesh.num_nodes());
    const double change = (truth - plain.truths[0].displacement).colwise().norm().maxCoeff();
    if (of_the_brain.count(ingredient) > 0) {
      EXPECT_GT(change, 0.02) << name_of({ingredient});
    } else {
      EXPECT_EQ(change, 0.0) << name_of({ingredient});
    }
    EXPECT_NE(wire::encode(adverse->observations[0]), wire::encode(plain.observations[0]))
        << name_of({ingredient});
  }
}

// What an ingredient draws does not depend on the others.
TEST(Ingredients, AreTheSameAloneAndTogether) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Vec3 gravity = adverse_patient().gravity_direction;
    const Adversity all = with_ingredients(pressed(), all_but_mesh(), gravity, seed)->adverse;
    const auto alone = [&](Ingredient ingredient) {
      return with_ingredients(pressed(), {ingredient}, gravity, seed)->adverse;
    };
    EXPECT_EQ(all.gap_seed, alone(Ingredient::kGap).gap_seed);
    EXPECT_EQ(all.penalty_factor, alone(Ingredient::kPenalty).penalty_factor);
    EXPECT_EQ(all.tissue_seed, alone(Ingredient::kStiffness).tissue_seed);
    EXPECT_EQ(all.level_error_mm, alone(Ingredient::kLevel).level_error_mm);
    EXPECT_EQ(all.gravity_error_deg, alone(Ingredient::kGravity).gravity_error_deg);
    EXPECT_EQ(all.probe.tracker_seed, alone(Ingredient::kTracker).probe.tracker_seed);
    EXPECT_EQ(all.probe.calibration_seed, alone(Ingredient::kCalibration).probe.calibration_seed);
    EXPECT_EQ(all.segmentation_seed, alone(Ingredient::kSegmentation).segmentation_seed);
    EXPECT_EQ(all.probe.sweep_seed, alone(Ingredient::kPartialSweep).probe.sweep_seed);
  }
}

TEST(Ingredients, OfALevelAndOfGravityHaveTheirSize) {
  std::set<double> levels;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto adverse = with_ingredients(pressed(), {Ingredient::kLevel, Ingredient::kGravity},
                                          adverse_patient().gravity_direction, seed);
    ASSERT_TRUE(adverse);
    levels.insert(adverse->adverse.level_error_mm);
    const Gravity gravity = gravity_of(adverse_patient(), *adverse);
    const double cosine = gravity.direction.dot(adverse_patient().gravity_direction);
    EXPECT_NEAR(std::acos(cosine) * 180.0 / std::numbers::pi, 10.0, 1e-6);
  }
  EXPECT_EQ(levels, (std::set<double>{-10.0, 10.0}));
}

TEST(Gap, LiesBetweenItsBoundsAndVaries) {
  const auto scenario =
      with_ingredients(pressed(), {Ingredient::kGap}, adverse_patient().gravity_direction, 3);
  const auto brain =
      value_or_fail(truth_brain(adverse_patient(), test_support::toy_config(), *scenario, 1));
  const auto forward = value_or_fail(truth_forward(brain));
  ASSERT_EQ(forward.contact().pairs().size(), adverse_patient().slaves.size());
  double least = 100.0, most = 0.0;
  for (const contact::ContactPair& pair : forward.contact().pairs()) {
    least = std::min(least, -pair.initial_penetration_mm);
    most = std::max(most, -pair.initial_penetration_mm);
  }
  EXPECT_GE(least, kMinGap_mm);
  EXPECT_LE(most, kMaxGap_mm);
  EXPECT_GT(most - least, 0.5);
}

// Errors of a calibration move all sections alike; those of a tracker each in its own way.
TEST(Probe, TrackerAndCalibrationMoveSectionsAsTheirNamesSay) {
  const Points section = adverse_patient().tumour.vertices;
  const Vec3 centre = section.rowwise().mean(), probe(30, 30, 60);
  ProbeErrors errors;
  errors.calibration_sd_mm = 0.5;
  errors.calibration_sd_deg = 0.5;
  errors.calibration_seed = 4;
  ProbeError calibration(errors);
  Points first = section, second = section;
  calibration.disturb(first, centre, probe);
  calibration.disturb(second, centre, probe);
  EXPECT_EQ(first, second);
  EXPECT_GT((first - section).colwise().norm().mean(), 0.05);
  ProbeErrors jitter;
  jitter.tracker_sd_mm = 0.35;
  jitter.tracker_seed = 4;
  ProbeError tracker(jitter);
  double squares = 0.0;
  constexpr int kSections = 2000;
  for (int i = 0; i < kSections; ++i) {
    Points moved = section.leftCols(1);
    tracker.disturb(moved, centre, probe);
    squares += (moved - section.leftCols(1)).squaredNorm() / (3.0 * kSections);
  }
  EXPECT_NEAR(std::sqrt(squares), 0.35, 0.02);
  Points still = section;
  ProbeError(ProbeErrors{}).disturb(still, centre, probe);
  EXPECT_EQ(still, section);
}

TEST(Probe, APartialSweepLeavesASideOfTheTumourOut) {
  const auto whole = value_or_fail(play({}));
  const auto partial = value_or_fail(play({Ingredient::kPartialSweep}));
  const double share = static_cast<double>(boundary_of(partial).cols()) /
                       static_cast<double>(boundary_of(whole).cols());
  EXPECT_GT(share, 0.4);
  EXPECT_LT(share, 0.8);
}

TEST(Misfit, TheLoadFollowsTheDisplacementThatTheTumourMustHave) {
  for (const double wanted_mm : {1.0, 4.0}) {
    Scenario scenario = pressed();
    scenario.tumour_displacement_mm = wanted_mm;
    const auto surgery = value_or_fail(play({}, 1, scenario));
    EXPECT_NEAR(surgery.truths[0].scalars.at("tumour_displacement_mm"), wanted_mm,
                0.005 * wanted_mm);
    EXPECT_GT(surgery.truths[0].scalars.at("load_scale"), 0.0);
  }
}

// Every ingredient where it cannot do anything.
TEST(Effects, WhatDoesNothingIsAnErrorThatSaysWhy) {
  const auto refused = [](const Ingredients& ingredients, const Scenario& scenario,
                          const char* why) {
    EXPECT_THAT(refusal_of(play(ingredients, 1, scenario), ErrorCode::kInvalidArgument),
                testing::AllOf(HasSubstr("does nothing"), HasSubstr(why)));
  };
  Scenario still = pressed();  // a little swelling, no weight
  still.fluid_levels_mm = {-300.0};
  still.swelling.volume_strain = 0.01;
  refused({Ingredient::kPenalty}, still, "no slave touches the skull");
  refused({Ingredient::kGap}, still, "nor would it with the case's gap");
  refused({Ingredient::kLevel}, still, "no tissue lies between");
  refused({Ingredient::kGravity}, still, "no tissue is out of the fluid");
  refused({Ingredient::kSegmentation}, *find_scenario("distension"), "displacements");
}

TEST(Effects, ATiltAboutTheAxisThatGravityLiesAlongIsAnError) {
  const Scenario& scenario = *find_scenario("joint-tangential");
  EXPECT_THAT(refusal_of(play_scenario(test_support::toy_patient(6), test_support::toy_config(),
                                       scenario, 1),
                         ErrorCode::kInvalidArgument),
              HasSubstr("joint-tangential does nothing on this case"));
}

}  // namespace
}  // namespace brainshift::client
