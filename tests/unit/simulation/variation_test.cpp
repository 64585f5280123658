// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "client/tools/twin/surgery.hpp"
#include "common/anatomy/brain_mesh.hpp"
#include "common/anatomy/brain_model_builder.hpp"
#include "common/geometry/surface.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::client {
namespace {

constexpr std::uint64_t kVariationSeeds = 400;

// Smallest and largest of what the variations of a scenario have.
template <typename Figure>
std::pair<double, double> extremes(const char* name, Figure figure) {
  double least = 1e300, most = -1e300;
  for (std::uint64_t seed = 1; seed <= kVariationSeeds; ++seed) {
    const double value = figure(vary(*find_scenario(name), seed));
    least = std::min(least, value);
    most = std::max(most, value);
  }
  return {least, most};
}

// Within [low, high], and within a twentieth of both ends: 400 uniform draws miss an end by that
// much once in 1e9 times.
void expect_fills(const std::pair<double, double>& extremes, double low, double high) {
  const double near = 0.05 * (high - low);
  EXPECT_GE(extremes.first, low);
  EXPECT_LT(extremes.first, low + near);
  EXPECT_LE(extremes.second, high);
  EXPECT_GT(extremes.second, high - near);
}

TEST(Variation, FillsItsRanges) {
  expect_fills(extremes("paper", [](const Scenario& s) { return s.fluid_levels_mm[0]; }), 40.0,
               70.0);
  expect_fills(extremes("paper", [](const Scenario& s) { return s.gravity_turn_deg.norm(); }), 0.0,
               6.0);
  expect_fills(extremes("distension", [](const Scenario& s) { return s.swelling.volume_strain; }),
               0.5 * 0.5, 1.3 * 0.5);
  expect_fills(extremes("joint-mixed", [](const Scenario& s) { return s.volume.strain; }), -0.02,
               0.0);
  expect_fills(
      extremes("resection", [](const Scenario& s) { return s.resection->volume_fraction; }), 0.6,
      0.8);
  expect_fills(extremes("retraction", [](const Scenario& s) { return s.retraction->pressure_pa; }),
               2000.0, 5200.0);
  expect_fills(extremes("retraction", [](const Scenario& s) { return s.retraction->angle_deg; }),
               0.0, 60.0);
}

// Gravity turns, and the swelling moves, in every direction: both signs of every axis.
TEST(Variation, HasNoFavouriteDirection) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto turn =
        extremes("paper", [axis](const Scenario& s) { return s.gravity_turn_deg[axis]; });
    EXPECT_LT(turn.first, -4.0);
    EXPECT_GT(turn.second, 4.0);
    const auto offset =
        extremes("distension", [axis](const Scenario& s) { return s.swelling.offset_mm[axis]; });
    EXPECT_LT(offset.first, -10.0);
    EXPECT_GT(offset.second, 10.0);
  }
  const auto distance =
      extremes("distension", [](const Scenario& s) { return s.swelling.offset_mm.norm(); });
  EXPECT_LE(distance.second, 15.0);
  const auto halves = extremes(
      "joint-mixed", [](const Scenario& s) { return s.volume.one_hemisphere ? 1.0 : 0.0; });
  EXPECT_EQ(halves, std::make_pair(0.0, 1.0));
}

TEST(Variation, OfAShrinkingSwellingShrinks) {
  Scenario shrinking = *find_scenario("distension");
  shrinking.swelling.volume_strain = -0.2;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_LT(vary(shrinking, seed).swelling.volume_strain, 0.0);
  }
}

TEST(Variation, AddsNoPartThatTheScenarioLacks) {
  for (const Scenario& scenario : all_scenarios()) {
    const Scenario varied = vary(scenario, 11);
    EXPECT_EQ(varied.name, scenario.name);
    EXPECT_EQ(varied.swelling.volume_strain != 0.0, scenario.swelling.volume_strain != 0.0);
    EXPECT_EQ(varied.resection.has_value(), scenario.resection.has_value());
    EXPECT_EQ(varied.retraction.has_value(), scenario.retraction.has_value());
    EXPECT_EQ(varied.volume.strain != 0.0, scenario.largest_shrinkage > 0.0);
    EXPECT_EQ(varied.gravity_tilt_deg, scenario.gravity_tilt_deg);
    EXPECT_EQ(varied.stiffness_sd, 0.3);
    EXPECT_EQ(varied.stiffness_length_mm, 20.0);
    EXPECT_FALSE(varied.contact_free);
  }
}

TEST(Variation, MovesAllMomentsOfASeriesAlike) {
  const Scenario& series = *find_scenario("sag-progress");
  const Scenario varied = vary(series, 5);
  for (std::size_t i = 1; i < series.fluid_levels_mm.size(); ++i) {
    EXPECT_NEAR(varied.fluid_levels_mm[i] - varied.fluid_levels_mm[0],
                series.fluid_levels_mm[i] - series.fluid_levels_mm[0], 1e-12);
  }
}

// Played on the toy patient: the same seed gives the same truth, another seed another one.
TEST(Variation, TheSeedDecidesTheTruth) {
  const auto truth = [](std::uint64_t seed) {
    Scenario scenario = vary(*find_scenario("joint-mixed"), seed);
    scenario.fluid_levels_mm[0] -= 20.0;              // the toy patient is smaller than a head
    BrainModel lying = test_support::toy_patient(6);  // else the scenario's tilt does nothing
    lying.gravity_direction = Vec3(0.5, 0, -1).normalized();
    const auto surgery =
        value_or_fail(play_scenario(lying, test_support::toy_config(), scenario, seed));
    EXPECT_LT(surgery.truths[0].scalars.at("brain_volume_strain"), 0.0);
    return surgery.truths[0].displacement;
  };
  const Points first = truth(1);
  EXPECT_EQ(first, truth(1));
  for (std::uint64_t seed = 2; seed <= 4; ++seed) {
    EXPECT_GT((truth(seed) - first).colwise().norm().maxCoeff(), 0.05) << seed;
  }
}

// Gravity turned about its own direction pulls as before; turned about another axis by as much as
// the scenario's own tilt does, it is the tilt.
TEST(GravityTurn, IsARotationOfGravity) {
  Scenario scenario = *find_scenario("paper");
  scenario.fluid_levels_mm = {20.0};
  const auto play = [&] {
    const auto surgery = value_or_fail(
        play_scenario(test_support::toy_patient(6), test_support::toy_config(), scenario, 1));
    return surgery.truths[0].displacement;
  };
  const Points straight = play();
  scenario.gravity_turn_deg = Vec3(0, 0, 40);  // gravity is -z
  EXPECT_LT((play() - straight).colwise().norm().maxCoeff(), 1e-9);
  scenario.gravity_turn_deg = Vec3(0, 10, 0);
  const Points turned = play();
  // -z turned by +10 degrees about y is (-sin 10, 0, -cos 10): the brain goes to -x.
  EXPECT_LT((turned - straight).row(0).mean(), -0.02);
  EXPECT_LT(std::abs((turned - straight).row(1).mean()),
            0.2 * std::abs((turned - straight).row(0).mean()));
}

using anatomy::testing::ball_case;
using anatomy::testing::kBallCentre;
using anatomy::testing::kBallRadius_mm;
using testing::HasSubstr;

constexpr std::uint64_t kSeeds = 60;
// The mesh is flat between nodes 8 mm apart and its mask was smoothed by 2 mm.
constexpr double kFlat_mm = 0.6;

const TetMesh& ball() {
  static const TetMesh mesh = [] {
    const CaseInputs inputs = ball_case();
    const auto& tumour = std::get<TumourEllipsoid>(inputs.config.tumour);
    return *anatomy::make_brain_mesh(
        inputs, geometry::ellipsoid_surface(tumour.centre_mm, tumour.semi_axes_mm, 2.0));
  }();
  return mesh;
}

CaseConfig unvaried_patient(std::uint64_t seed) {
  return value_or_fail(vary_patient(ball_case().config, ball(), seed));
}

TEST(VariedPatient, HasTheTumourInsideTheBrainBelowTheOpening) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const CaseConfig config = unvaried_patient(seed);
    const auto& tumour = std::get<TumourEllipsoid>(config.tumour);
    for (const double axis : tumour.semi_axes_mm) {
      EXPECT_GE(axis, 8.0);
      EXPECT_LE(axis, 20.0);
    }
    // The farthest point of an ellipsoid from the ball's centre is within |c| + longest axis; the
    // exact one by its surface.
    const TriangleSurface surface =
        geometry::ellipsoid_surface(tumour.centre_mm, tumour.semi_axes_mm, 1.0);
    EXPECT_LE((surface.vertices.colwise() - kBallCentre).colwise().norm().maxCoeff(),
              kBallRadius_mm - 3.0 + kFlat_mm)
        << seed;
    const Vec3 opening = config.craniotomy.centre_mm - kBallCentre;
    EXPECT_NEAR(opening.norm(), kBallRadius_mm, kFlat_mm + 0.5) << seed;
    const double depth = (config.craniotomy.centre_mm - tumour.centre_mm).norm();
    EXPECT_GE(depth, 10.0 - 1e-9);
    EXPECT_LE(depth, 35.0 + 1e-9);
    // 20 degrees beside the normal; the mesh's triangles are up to 5 degrees beside the ball's.
    EXPECT_GT(
        (config.craniotomy.centre_mm - tumour.centre_mm).normalized().dot(opening.normalized()),
        std::cos(26.0 * 3.14159265 / 180.0))
        << seed;
  }
}

TEST(VariedPatient, IsOpenedAboveTheSkullBaseAndBesideTheMidline) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Vec3 opening = unvaried_patient(seed).craniotomy.centre_mm - kBallCentre;
    EXPECT_GE(opening[2], -50.0 + 0.4 * 100.0 - 1.5) << seed;
    EXPECT_GE(std::abs(opening[0]), 12.0 - 1.0) << seed;
    EXPECT_GE(unvaried_patient(seed).craniotomy.long_axis_mm,
              unvaried_patient(seed).craniotomy.short_axis_mm);
  }
}

TEST(VariedPatient, LiesSoThatTheOpeningIsAboutUppermostAndTheHeadNotDown) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const CaseConfig config = unvaried_patient(seed);
    const Vec3 up = -config.gravity_direction;
    EXPECT_NEAR(up.norm(), 1.0, 1e-12);
    const Vec3 opening = (config.craniotomy.centre_mm - kBallCentre).normalized();
    EXPECT_GT(up.dot(opening), std::cos(51.0 * 3.14159265 / 180.0)) << seed;
    EXPECT_GE(up[2], -std::sin(15.001 * 3.14159265 / 180.0)) << seed;
  }
}

TEST(VariedPatient, TheSeedDecidesAndNothingElseOfTheCaseChanges) {
  const CaseConfig before = ball_case().config;
  std::set<double> depths;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const CaseConfig a = unvaried_patient(seed), b = unvaried_patient(seed);
    EXPECT_EQ(a.craniotomy.centre_mm, b.craniotomy.centre_mm);
    EXPECT_EQ(a.gravity_direction, b.gravity_direction);
    EXPECT_EQ(a.case_id, before.case_id + "-" + std::to_string(seed));
    EXPECT_EQ(a.brain, before.brain);
    EXPECT_EQ(a.brainstem.centre_mm, before.brainstem.centre_mm);
    EXPECT_EQ(a.material.shear_modulus_pa, before.material.shear_modulus_pa);
    depths.insert(std::get<TumourEllipsoid>(a.tumour).centre_mm.norm());
  }
  EXPECT_EQ(depths.size(), 10u);
}

TEST(VariedPatient, CanBeBuilt) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CaseInputs inputs = ball_case();
    inputs.config = unvaried_patient(seed);
    const auto model = anatomy::build_brain_model(inputs);
    ASSERT_TRUE(model) << seed << ": " << model.error().message;
    EXPECT_FALSE(model->craniotomy.empty());
    EXPECT_FALSE(model->slaves.empty());
    EXPECT_FALSE(model->fixed.empty());
  }
}

TEST(VariedPatient, AHeadThatHoldsNoTumourIsRefused) {
  TetMesh small = ball();
  small.nodes = (0.3 * (small.nodes.colwise() - kBallCentre)).colwise() + kBallCentre;
  const auto config = vary_patient(ball_case().config, small, 1);
  EXPECT_THAT(refusal_of(config, ErrorCode::kNotConverged), HasSubstr("ball"));
  EXPECT_FALSE(vary_patient(ball_case().config, TetMesh{}, 1));
}

}  // namespace

// Patients on a ball of 50 mm: what lies where is known exactly.

}  // namespace brainshift::client
