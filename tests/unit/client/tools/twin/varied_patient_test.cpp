// SPDX-License-Identifier: GPL-3.0-or-later
// Patients on a ball of 50 mm: what lies where is known exactly.
#include "client/tools/twin/varied_patient.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "common/anatomy/brain_mesh.hpp"
#include "common/anatomy/brain_model_builder.hpp"
#include "common/geometry/surface.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::client {
namespace {

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
  auto config = vary_patient(ball_case().config, ball(), seed);
  EXPECT_TRUE(config) << config.error().message;
  return std::move(*config);
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
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().code, ErrorCode::kNotConverged);
  EXPECT_THAT(config.error().message, HasSubstr("ball"));
  EXPECT_FALSE(vary_patient(ball_case().config, TetMesh{}, 1));
}

}  // namespace
}  // namespace brainshift::client
