// SPDX-License-Identifier: GPL-3.0-or-later
// The named scenarios on the toy patient. Their descriptions tell their size in the default head.
#include <gmock/gmock.h>

#include <set>

#include "client/tools/twin/load.hpp"
#include "client/tools/twin/scenario.hpp"
#include "client/tools/twin/surgery.hpp"
#include "client/tools/twin/truth.hpp"
#include "common/fem/body_loads.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/registration/surface_distances.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/contact_search.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

TEST(Scenarios, AreNamedOnceAndDescribedInOneLine) {
  std::set<std::string> names;
  for (const Scenario& info : all_scenarios()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.description.empty());
    EXPECT_EQ(info.description.find('\n'), std::string::npos);
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"paper", "paper-icp", "distension", "sag-progress", "no-contact",
                                   "joint-sag", "joint-distension", "joint-tangential",
                                   "joint-mixed", "resection", "retraction", "patient-1",
                                   "patient-2", "patient-3", "patient-4", "patient-5"}));
}

TEST(SagProgress, TheFluidFallsSteadilyFrom15To55InTwentyObservations) {
  const Scenario* scenario = find_scenario("sag-progress");
  ASSERT_NE(scenario, nullptr);
  const auto& levels = scenario->fluid_levels_mm;
  ASSERT_EQ(levels.size(), 20u);
  EXPECT_DOUBLE_EQ(levels.front(), 15.0);
  EXPECT_DOUBLE_EQ(levels.back(), 55.0);
  for (std::size_t i = 1; i < levels.size(); ++i) {
    EXPECT_NEAR(levels[i] - levels[i - 1], 40.0 / 19.0, 1e-12);
  }
}

class TruthSolverTest : public testing::Test {
 protected:
  Points load(double fluid_level_mm, double strain) const {
    const Vec3 g = model.gravity_direction;
    const Points gravity = fem::buoyancy_load(model.mesh, config.material, g,
                                              model.fluid_plane_depth_mm + fluid_level_mm, g);
    return gravity + swelling_load(model.mesh, config.material, Vec3(30, 30, 40), {strain, 45.0});
  }
  BrainModel model = test_support::toy_patient(6);
  CaseConfig config = test_support::toy_config();
  Result<contact::ForwardModel> forward =
      contact::ForwardModel::build(model, config, Boundary::kContact);
};

// From no active slave to all 88 of them. The reference begins every search from the empty set and
// factorises K_p anew for every set.
TEST_F(TruthSolverTest, EqualsASearchFromTheEmptySetForEveryLoadOfASeries) {
  ASSERT_TRUE(forward);
  TruthSolver solver(*forward);
  std::set<int> active;
  for (const double strain : {0.0, 0.1, 0.13, 0.13, 0.11, -0.3, 0.09, 0.16, 0.6}) {
    SCOPED_TRACE(strain);
    const Points b = load(20.0, strain);
    const auto truth = value_or_fail(solver.solve(b));
    const auto reference = value_or_fail(test_support::solve_with_contact(*forward, b));
    ASSERT_TRUE(reference.converged);
    EXPECT_EQ(truth.active, contact::count(reference.active));
    EXPECT_LT((truth.displacement - reference.displacement).norm(),
              1e-9 * reference.displacement.norm());
    EXPECT_DOUBLE_EQ(truth.max_penetration_mm,
                     forward->contact().penetration(truth.displacement).maxCoeff());
    active.insert(truth.active);
  }
  EXPECT_GE(active.size(), 5u) << "the loads must differ in what touches the skull";
  EXPECT_EQ(active.count(0), 1u);
}

TEST_F(TruthSolverTest, TheSameLoadAgainTakesOneSolve) {
  ASSERT_TRUE(forward);
  TruthSolver solver(*forward);
  const Points b = load(20.0, 0.5);
  const auto first = value_or_fail(solver.solve(b));
  ASSERT_GT(first.active, 0);
  EXPECT_GT(first.iterations, 1);
  const auto again = value_or_fail(solver.solve(b));
  EXPECT_EQ(again.iterations, 1);
  EXPECT_EQ(again.displacement, first.displacement);
}

using testing::HasSubstr;

// As many as the default head needs for "more than 500 of its 2,394 slaves".
constexpr double kWideContact = 500.0 / 2394.0;

const BrainModel& patient() {
  static const BrainModel model = test_support::toy_patient(6);
  return model;
}

Result<SimulatedSurgery> play_named(const std::string& name, std::uint64_t seed = 1,
                                    const BrainModel& model = patient()) {
  const Scenario* scenario = find_scenario(name);
  EXPECT_NE(scenario, nullptr) << name;
  return play_scenario(model, test_support::toy_config(), *scenario, seed);
}

const LandmarkPairs& pairs_of(const Observation& observation) {
  return std::get<LandmarkPairs>(observation.body);
}

TEST(Distension, PressesAWideFrontAgainstTheSkullWithoutPenetratingIt) {
  Scenario scenario = *find_scenario("distension");
  scenario.swelling.radius_mm *= 0.7;  // the toy patient is smaller than a head
  scenario.swelling.depth_mm *= 0.3;
  const auto surgery =
      value_or_fail(play_scenario(patient(), test_support::toy_config(), scenario, 1));
  ASSERT_EQ(surgery.truths.size(), 1u);
  const auto& scalars = surgery.truths[0].scalars;
  EXPECT_GT(scalars.at("active_slaves"),
            kWideContact * static_cast<double>(patient().slaves.size()));
  EXPECT_GT(scalars.at("max_penetration_mm"), 0.0);
  EXPECT_LT(scalars.at("max_penetration_mm"), 0.1);  // force / beta: the penalty's own compliance
  EXPECT_GT(scalars.at("tumour_displacement_mm"), 0.5);
  EXPECT_LT(scalars.at("max_displacement_mm"), 10.0);
  EXPECT_GT(scalars.at("swelling_volume_strain"), 0.0);
}

Scenario joint_on_the_toy() {
  Scenario scenario = *find_scenario("joint-sag");
  scenario.fluid_levels_mm = {10.0, 20.0};
  scenario.cortex->tracks = 5;
  return scenario;
}

TEST(Joint, EveryMomentIsSeenByThreeInstrumentsWithTheSameTruth) {
  const Scenario scenario = joint_on_the_toy();
  const auto surgery =
      value_or_fail(play_scenario(patient(), test_support::toy_config(), scenario, 1));
  ASSERT_EQ(surgery.observations.size(), 6u);
  const char* const sources[] = {"ius", "stereopsis", "tracks"};
  for (std::size_t i = 0; i < 6; ++i) {
    const Observation& observation = surgery.observations[i];
    EXPECT_EQ(observation.source, sources[i % 3]);
    EXPECT_EQ(observation.sequence, i + 1);
    if (i > 0) {
      EXPECT_GT(observation.acquired_ns, surgery.observations[i - 1].acquired_ns);
    }
    EXPECT_EQ(surgery.truths[i].displacement, surgery.truths[3 * (i / 3)].displacement);
  }
  EXPECT_NE(surgery.truths[0].displacement, surgery.truths[3].displacement);
  EXPECT_EQ(pairs_of(surgery.observations[2]).undeformed.cols(), 5);
}

// The measured cortex lies on the deformed one, up to noise and the camera's pose.
TEST(Joint, TheCortexIsMeasuredWhereItIs) {
  Scenario scenario = joint_on_the_toy();
  scenario.cortex->noise_sd_mm = 0.0;
  scenario.cortex->pose_sd_mm = 0.0;
  scenario.cortex->pose_sd_deg = 0.0;
  const auto exact =
      value_or_fail(play_scenario(patient(), test_support::toy_config(), scenario, 1));
  const auto patch = registration::craniotomy_patch(patient());
  const Points& truth = exact.truths[1].displacement;
  const TriangleSurface deformed{patch.surface.vertices + truth(Eigen::all, patch.nodes),
                                 patch.surface.triangles};
  const auto index = value_or_fail(geometry::ClosestPointIndex::build(deformed));
  const auto& measured = std::get<CorticalSurface>(exact.observations[1].body).surface.vertices;
  ASSERT_GT(measured.cols(), 100);
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    EXPECT_LT(index.closest(measured.col(i)).distance_mm, 1e-9);
  }
  scenario.cortex->pose_sd_mm = 1.0;
  const auto shifted =
      value_or_fail(play_scenario(patient(), test_support::toy_config(), scenario, 1));
  const auto& moved = std::get<CorticalSurface>(shifted.observations[1].body).surface.vertices;
  const Points shift = moved - measured;  // the same points, moved alike
  EXPECT_LT((shift.colwise() - Vec3(shift.col(0))).colwise().norm().maxCoeff(), 1e-9);
  EXPECT_GT(shift.col(0).norm(), 0.1);
}

TEST(Joint, GravityBesideItsKnownDirectionPullsTheBrainThere) {
  Scenario scenario = joint_on_the_toy();
  scenario.fluid_levels_mm = {20.0};
  scenario.stiffness_sd = 0.0;
  BrainModel lying = patient();  // else gravity runs along the axis of the craniotomy
  lying.gravity_direction = Vec3(1, 0, -1).normalized();
  const auto straight =
      value_or_fail(play_scenario(lying, test_support::toy_config(), scenario, 1));
  scenario.gravity_tilt_deg = 25.0;
  const auto tilted = value_or_fail(play_scenario(lying, test_support::toy_config(), scenario, 1));
  const Points change = tilted.truths[0].displacement - straight.truths[0].displacement;
  EXPECT_GT(change.colwise().norm().maxCoeff(),
            0.1 * straight.truths[0].displacement.colwise().norm().maxCoeff());
}

TEST(SagProgress, EveryObservationHasItsOwnTruthAndTheSagGrows) {
  const auto surgery = value_or_fail(play_named("sag-progress"));
  ASSERT_EQ(surgery.observations.size(), 20u);
  ASSERT_EQ(surgery.truths.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    const Observation& observation = surgery.observations[i];
    EXPECT_EQ(observation.sequence, i + 1);
    EXPECT_EQ(observation.acquired_ns, static_cast<std::int64_t>(i) * 30'000'000'000);
    EXPECT_EQ(observation.case_id, patient().case_id);
    const auto& scalars = surgery.truths[i].scalars;
    EXPECT_DOUBLE_EQ(scalars.at("fluid_level_mm"),
                     find_scenario("sag-progress")->fluid_levels_mm[i]);
    if (i == 0) continue;
    const auto& before = surgery.truths[i - 1].scalars;
    EXPECT_GT(scalars.at("tumour_displacement_mm"), before.at("tumour_displacement_mm")) << i;
    // Along gravity, summed over the brain.
    const Vec3 g = patient().gravity_direction;
    EXPECT_GT((surgery.truths[i].displacement.transpose() * g).sum(),
              (surgery.truths[i - 1].displacement.transpose() * g).sum());
  }
}

TEST(SagProgress, PointsAndNoiseAreFreshEveryTime) {
  const auto surgery = value_or_fail(play_named("sag-progress"));
  std::set<double> seen;
  for (const Observation& observation : surgery.observations) {
    const LandmarkPairs& pairs = pairs_of(observation);
    seen.insert((pairs.deformed - pairs.undeformed).norm());
  }
  EXPECT_EQ(seen.size(), 20u);
  EXPECT_NE(pairs_of(surgery.observations[0]).undeformed.col(0),
            pairs_of(surgery.observations[1]).undeformed.col(0));
}

TEST(Measurement, CarriesNoiseAroundTheTruthAndNothingElseOfIt) {
  const auto surgery = value_or_fail(play_named("sag-progress"));
  double sum = 0.0, squares = 0.0;
  int points = 0;
  for (std::size_t i = 0; i < surgery.observations.size(); ++i) {
    const LandmarkPairs& pairs = pairs_of(surgery.observations[i]);
    const auto& sparse = surgery.truths[i].points.at("sparse");
    ASSERT_EQ(pairs.undeformed.cols(),
              std::min<Eigen::Index>(200, patient().tumour.num_vertices()));
    EXPECT_NEAR(pairs.sd_mm, 0.51 / std::sqrt(3.0), 1e-12);
    // The truth lists its points in the order of the vertices, the
    // observation in that of the draw.
    for (Eigen::Index k = 0; k < pairs.undeformed.cols(); ++k) {
      for (const io::ScorePoint& point : sparse) {
        Vec3 x = Vec3::Zero(), u = Vec3::Zero();
        for (int n = 0; n < 4; ++n) {
          x += point.weights[n] * patient().mesh.nodes.col(point.nodes[n]);
          u += point.weights[n] * surgery.truths[i].displacement.col(point.nodes[n]);
        }
        if ((x - pairs.undeformed.col(k)).norm() > 1e-9) continue;
        const double noise = (pairs.deformed.col(k) - pairs.undeformed.col(k) - u).norm();
        EXPECT_GT(noise, 0.0);
        sum += noise;
        squares += noise * noise;
        ++points;
      }
    }
  }
  ASSERT_GT(points, 1000);
  EXPECT_NEAR(std::sqrt(squares / points), 0.51, 0.03);  // standard error below 0.01
}

// The toy patient's craniotomy is its top: nothing of it emerges while
// the fluid stands above that.
TEST(NoContact, StaysOffTheSkull) {
  Scenario scenario = *find_scenario("no-contact");
  EXPECT_TRUE(scenario.contact_free);
  EXPECT_LT(scenario.fluid_levels_mm.at(0), 0.0);
  scenario.fluid_levels_mm = {10.0};
  const auto surgery =
      value_or_fail(play_scenario(patient(), test_support::toy_config(), scenario, 1));
  const auto& scalars = surgery.truths.front().scalars;
  EXPECT_EQ(scalars.at("active_slaves"), 0.0);
  EXPECT_LT(scalars.at("max_penetration_mm"), -0.1);
  EXPECT_GT(scalars.at("tumour_displacement_mm"), 0.05);
  EXPECT_EQ(scalars.count("swelling_radius_mm"), 0u);
}

TEST(NoContact, ACaseThatBreaksThePromiseIsRefused) {
  const BrainModel tight = test_support::toy_patient(6, 1e-6);  // no gap to fall away into
  Scenario scenario = *find_scenario("no-contact");
  scenario.swelling = {0.3, 40.0};
  EXPECT_THAT(refusal_of(play_scenario(tight, test_support::toy_config(), scenario, 1),
                         ErrorCode::kInvalidArgument),
              testing::AllOf(HasSubstr("no-contact"), HasSubstr("slaves")));
}

TEST(Surgery, DependsOnTheSeedAlone) {
  const auto a = play_named("distension", 4), b = play_named("distension", 4),
             c = play_named("distension", 5);
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(wire::encode(a->observations[0]), wire::encode(b->observations[0]));
  EXPECT_NE(wire::encode(a->observations[0]), wire::encode(c->observations[0]));
  EXPECT_EQ(a->truths[0].displacement, c->truths[0].displacement);
}

TEST(Surgery, TellsHowFarItIs) {
  double last = -1.0;
  int reports = 0;
  const auto surgery =
      play_scenario(patient(), test_support::toy_config(), *find_scenario("sag-progress"), 1,
                    [&](std::string_view stage, double fraction) {
                      if (stage != "solve with contact") return;
                      EXPECT_GT(fraction, last);
                      last = fraction;
                      ++reports;
                    });
  ASSERT_TRUE(surgery);
  EXPECT_EQ(reports, 21);
  EXPECT_DOUBLE_EQ(last, 1.0);
}

TEST(GivenTruth, CountsTheSlavesInTheSkull) {
  std::vector<contact::ContactPair> pairs(2);
  pairs[0].slave = 0;
  pairs[1].slave = 1;
  for (contact::ContactPair& pair : pairs) {
    pair.normal = Vec3(0, 0, -1);  // out of the skull
    pair.initial_penetration_mm = -1.0;
  }
  Points u = Points::Zero(3, 2);
  u(2, 0) = 1.5;
  GivenTruth truth(u, contact::PenaltyContact(pairs, 5.0));
  const auto solved = value_or_fail(truth.solve(Points::Zero(3, 2)));
  EXPECT_EQ(solved.displacement, u);
  EXPECT_EQ(solved.active, 1);
  EXPECT_NEAR(solved.max_penetration_mm, 0.5, 1e-12);
}

}  // namespace
}  // namespace brainshift::client
