// SPDX-License-Identifier: GPL-3.0-or-later
// A resection of the toy patient, whose tumour is a ball of 10 mm at (30, 30, 40) below an opening
// in the plane z = 60 mm.
#include "client/tools/twin/resection.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <set>

#include "client/tools/twin/surgery.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/units.hpp"
#include "common/fem/body_loads.hpp"
#include "common/geometry/closest_point.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

const Vec3 kTumour(30, 30, 40);
constexpr double kRadius_mm = 10.0;

const BrainModel& resected_patient() {
  static const BrainModel model = test_support::toy_patient(12);
  return model;
}

ResectedBrain resected(double fraction, const CaseConfig& config = test_support::toy_config()) {
  return value_or_fail(resect(resected_patient(), config, {fraction}));
}

Vec3 centre_of(int tet) {
  return resected_patient()
      .mesh.nodes(Eigen::all, resected_patient().mesh.tets.col(tet))
      .rowwise()
      .mean();
}

double volume_of(int tet) {
  const auto x =
      resected_patient().mesh.nodes(Eigen::all, resected_patient().mesh.tets.col(tet)).eval();
  return std::abs((x.col(1) - x.col(0)).cross(x.col(2) - x.col(0)).dot(x.col(3) - x.col(0))) / 6.0;
}

// Tetrahedra whose shear modulus differs from that before.
std::set<int> softened(const ResectedBrain& brain, const CaseConfig& before) {
  const auto was = contact::tissue_map(resected_patient(), before.material);
  const auto is = contact::tissue_map(brain.model, brain.config.material);
  EXPECT_TRUE(was && is);
  std::set<int> tets;
  for (int t = 0; t < resected_patient().mesh.num_tets(); ++t) {
    const double ratio = is->at(t).elastic.shear / was->at(t).elastic.shear;
    if (ratio == 1.0) continue;
    EXPECT_NEAR(ratio, kCavityStiffness, 1e-12) << t;
    EXPECT_EQ(is->at(t).elastic.lambda, 0.0) << t;  // no Poisson ratio: it keeps no volume
    tets.insert(t);
  }
  return tets;
}

TEST(Resection, SoftensTheSuperficialPartOfTheTumourAndNothingElse) {
  const CaseConfig config = test_support::toy_config();
  const std::set<int> soft = softened(resected(0.7, config), config);
  const std::set<int> whole = softened(resected(1.0, config), config);
  double removed = 0.0, all = 0.0, largest = 0.0, deepest_removed = 60.0, highest_left = 0.0;
  for (int t = 0; t < resected_patient().mesh.num_tets(); ++t) {
    const Vec3 x = centre_of(t);
    // The surface of the ball is made of triangles of 4 mm: 0.2 mm inside it at most.
    const double radius = (x - kTumour).norm();
    if (soft.count(t)) {
      EXPECT_LT(radius, kRadius_mm);
      removed += volume_of(t);
      deepest_removed = std::min(deepest_removed, x[2]);
    } else if (radius < kRadius_mm - 0.3) {
      highest_left = std::max(highest_left, x[2]);
    }
    if (whole.count(t)) all += volume_of(t);
    largest = std::max(largest, volume_of(t));
  }
  EXPECT_GE(deepest_removed, highest_left - 1e-9);
  EXPECT_GE(removed, 0.7 * all);
  EXPECT_LE(removed, 0.7 * all + largest);
}

TEST(Resection, OfTheWholeTumourLeavesNothingOfIt) {
  const CaseConfig config = test_support::toy_config();
  const ResectedBrain brain = resected(1.0, config);
  const std::set<int> soft = softened(brain, config);
  for (int t = 0; t < resected_patient().mesh.num_tets(); ++t) {
    const double radius = (centre_of(t) - kTumour).norm();
    if (radius < kRadius_mm - 0.3) {
      EXPECT_EQ(soft.count(t), 1u) << t;
    } else if (radius > kRadius_mm) {
      EXPECT_EQ(soft.count(t), 0u) << t;
    }
  }
  EXPECT_EQ(brain.tissue.num_tets() + static_cast<int>(soft.size()),
            resected_patient().mesh.num_tets());
}

TEST(Resection, TheRestOfAStiffTumourStaysStiff) {
  CaseConfig config = test_support::toy_config();
  config.material.tumour = TissueStiffness{9000.0, 0.4};
  const ResectedBrain brain = resected(0.5, config);
  const auto is = value_or_fail(contact::tissue_map(brain.model, brain.config.material));
  int stiff = 0, soft = 0;
  for (int t = 0; t < resected_patient().mesh.num_tets(); ++t) {
    const double pa = is.at(t).elastic.shear / units::stress_from_pa(1.0);
    const bool deep = centre_of(t)[2] < kTumour[2] - 2.0;
    if ((centre_of(t) - kTumour).norm() > kRadius_mm) {
      EXPECT_NEAR(pa, 2100.0, 1e-6) << t;
    } else if (pa > 8999.0) {
      ++stiff;
      EXPECT_LT(centre_of(t)[2], kTumour[2] + 2.0);
    } else {
      soft += pa < 10.0 ? 1 : 0;
      EXPECT_FALSE(deep && (centre_of(t) - kTumour).norm() < kRadius_mm - 0.3) << t;
    }
  }
  EXPECT_GT(stiff, 5);
  EXPECT_GT(soft, 5);
}

TEST(Resection, ComesOnTopOfStiffnessThatVaries) {
  Scenario scenario = *find_scenario("resection");
  scenario.stiffness_length_mm = 8.0;
  const auto brain =
      value_or_fail(truth_brain(resected_patient(), test_support::toy_config(), scenario, 3));
  const auto map = value_or_fail(contact::tissue_map(brain.model, brain.config.material));
  std::set<double> inside, outside;
  for (int t = 0; t < resected_patient().mesh.num_tets(); ++t) {
    const double g = map.at(t).elastic.shear;
    ((centre_of(t) - kTumour).norm() > kRadius_mm ? outside : inside).insert(g);
  }
  EXPECT_EQ(outside.size(), 9u);  // the classes of stiffness.hpp
  EXPECT_NEAR(*inside.begin() / units::stress_from_pa(2100.0), kCavityStiffness, 1e-12);
}

// The loads of what is left hang on its tetrahedra alone: together its volume times its weight.
TEST(Resection, WhatIsGoneHasNoWeight) {
  const CaseConfig config = test_support::toy_config();
  const ResectedBrain brain = resected(0.7, config);
  double removed = 0.0;
  for (const int t : softened(brain, config)) removed += volume_of(t);
  ASSERT_GT(removed, 1000.0);
  const Vec3 down(0, 0, -1);
  const Points before =
      fem::buoyancy_load(resected_patient().mesh, config.material, down, 1e6, down);
  const Points after = fem::buoyancy_load(brain.tissue, config.material, down, 1e6, down);
  const double density = units::weight_density_from_kg_m3(999.0);
  EXPECT_NEAR((before - after).rowwise().sum()[2], -removed * density, 1e-9);
}

TEST(Resection, ANodeIsAttachedWhereTissueIsLeftAroundIt) {
  const CaseConfig config = test_support::toy_config();
  const ResectedBrain brain = resected(1.0, config);
  const std::set<int> soft = softened(brain, config);
  std::vector<int> around(static_cast<std::size_t>(resected_patient().mesh.num_nodes()), 0);
  for (int t = 0; t < resected_patient().mesh.num_tets(); ++t) {
    if (soft.count(t)) continue;
    for (int k = 0; k < 4; ++k)
      ++around[static_cast<std::size_t>(resected_patient().mesh.tets(k, t))];
  }
  int removed = 0;
  for (std::size_t i = 0; i < around.size(); ++i) {
    EXPECT_EQ(brain.attached[i] != 0, around[i] > 0) << i;
    removed += around[i] == 0 ? 1 : 0;
  }
  EXPECT_GT(removed, 5);
}

class ResectedSurgery : public testing::Test {
 protected:
  static Scenario scenario() {
    Scenario scenario = *find_scenario("resection");
    scenario.fluid_levels_mm = {20.0};
    scenario.stiffness_sd = 0.0;
    scenario.resection->volume_fraction = 0.9;
    scenario.noise_sd_mm = 0.0;
    scenario.cortex->tracks = 5;
    return scenario;
  }
  static SimulatedSurgery play(const Scenario& scenario) {
    return value_or_fail(
        play_scenario(resected_patient(), test_support::toy_config(), scenario, 1));
  }
};

TEST_F(ResectedSurgery, TheBrainSagsIntoTheCavity) {
  Scenario whole = scenario();
  whole.resection.reset();
  const Points with = play(scenario()).truths[0].displacement;
  const Points without = play(whole).truths[0].displacement;
  // The roof of the cavity, between it and the opening, sinks farther; so does no other place
  // half as much.
  double roof = 0.0;
  for (int i = 0; i < resected_patient().mesh.num_nodes(); ++i) {
    const Vec3 x = resected_patient().mesh.nodes.col(i);
    if ((x - Vec3(30, 30, 50)).norm() < 1e-9) roof = without(2, i) - with(2, i);
  }
  EXPECT_GT(roof, 0.05);
  for (int i = 0; i < resected_patient().mesh.num_nodes(); ++i) {
    const Vec3 x = resected_patient().mesh.nodes.col(i);
    if ((x - kTumour).norm() < 25.0) continue;
    EXPECT_LT(without(2, i) - with(2, i), 0.5 * roof) << i;
  }
}

TEST_F(ResectedSurgery, NothingOfTheCavityIsMeasuredOrScored) {
  const SimulatedSurgery surgery = play(scenario());
  const auto& truth = surgery.truths[0];
  std::set<int> removed;
  for (const io::ScorePoint& point : truth.points.at("removed")) removed.insert(point.nodes[0]);
  ASSERT_GT(removed.size(), 2u);
  EXPECT_EQ(truth.scalars.at("removed_nodes"), static_cast<double>(removed.size()));
  EXPECT_DOUBLE_EQ(truth.scalars.at("resected_fraction"), 0.9);
  TriangleSurface deformed = resected_patient().tumour;
  std::vector<char> scored(static_cast<std::size_t>(deformed.num_vertices()), 0);
  ASSERT_GT(truth.points.at("cross").size(), 20u);
  for (const io::ScorePoint& point : truth.points.at("cross")) {
    Vec3 x = Vec3::Zero();
    for (int k = 0; k < 4; ++k) {
      x += point.weights[k] * resected_patient().mesh.nodes.col(point.nodes[k]);
      if (point.weights[k] > 0.0) {
        EXPECT_EQ(removed.count(point.nodes[k]), 0u);
      }
    }
    for (int v = 0; v < deformed.num_vertices(); ++v) {
      if ((deformed.vertices.col(v) - x).norm() > 1e-9) continue;
      scored[static_cast<std::size_t>(v)] = 1;
      for (int k = 0; k < 4; ++k) {
        deformed.vertices.col(v) += point.weights[k] * truth.displacement.col(point.nodes[k]);
      }
      break;
    }
  }
  // Without noise every measured point lies on a triangle whose corners are scored.
  const auto& points = std::get<TumourBoundary>(surgery.observations[0].body).points;
  ASSERT_GT(points.cols(), 50);
  const auto index = value_or_fail(geometry::ClosestPointIndex::build(deformed));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto closest = index.closest(points.col(i));
    EXPECT_LT(closest.distance_mm, 1e-6);
    int corners = 0;
    for (int k = 0; k < 3; ++k) {
      corners += scored[static_cast<std::size_t>(deformed.triangles(k, closest.triangle))];
    }
    EXPECT_GE(corners, 2);  // on an edge the closest triangle may be the one beside it
  }
}

TEST(ResectionRefusal, NamesTheFractionAndTheEmptyTumour) {
  const CaseConfig config = test_support::toy_config();
  for (const double fraction : {0.0, -0.1, 1.01, std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(
        refusal_of(resect(resected_patient(), config, {fraction}), ErrorCode::kInvalidArgument),
        HasSubstr("resection.volume_fraction"))
        << fraction;
  }
  BrainModel elsewhere = resected_patient();
  elsewhere.tumour.vertices.colwise() += Vec3(500, 0, 0);
  EXPECT_THAT(refusal_of(resect(elsewhere, config, {}), ErrorCode::kEmptySet), HasSubstr("tumour"));
}

}  // namespace
}  // namespace brainshift::client
