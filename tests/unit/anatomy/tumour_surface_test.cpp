// SPDX-License-Identifier: GPL-3.0-or-later
// How a tumour is fitted into the brain, and the making of a hollow one. More of the making is
// tested in brain_model_builder_test.cpp.
#include "common/anatomy/brain_mesh.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/geometry/ball_mask.hpp"

namespace brainshift::anatomy {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kRadius_mm = 10.0;

// The box |x| <= 40 mm, and a ball whose surface reaches x = 40 mm + out.
const TetMesh& box() {
  static const TetMesh mesh = test_support::box_mesh(Vec3::Constant(-40), Vec3::Constant(40), 8);
  return mesh;
}
TriangleSurface ball(double out_mm) {
  return geometry::ellipsoid_surface(Vec3(40.0 - kRadius_mm + out_mm, 3, -2),
                                     Vec3::Constant(kRadius_mm), 0.8);
}

// A wall of 2.1 mm round a hollow, as enhancement round a necrosis has.
TEST(TumourSurface, AHollowTumourHasBothOfItsWallsAndCgalPrintsNothing) {
  CaseInputs inputs;
  inputs.config.tumour = TumourLabel{"labels.nii", {1}};
  inputs.tumour_labels = geometry::balls::paint_balls(
      geometry::balls::empty_image(36, Vec3::Zero(), Mat3::Identity()), {{Vec3::Zero(), 10.8}},
      [](double depth) { return std::abs(depth) < 1.05 ? 1.0F : 0.0F; });
  ::testing::internal::CaptureStderr();
  const auto surface = value_or_fail(make_tumour_surface(inputs, nullptr));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_TRUE(geometry::is_closed(surface));
  // Of 3,100 mm3: smoothing by 1 mm and sampling take up to a fifth of so thin a wall.
  EXPECT_NEAR(geometry::enclosed_volume(surface), 2800.0, 320.0);
  const VecX radii = surface.vertices.colwise().norm();
  EXPECT_NEAR(radii.minCoeff(), 9.7, 0.6);
  EXPECT_NEAR(radii.maxCoeff(), 11.9, 0.6);
}

TEST(FitTumour, ATumourInsideStaysAsItIs) {
  const TriangleSurface inside = ball(-0.01);
  const auto fitted = value_or_fail(fit_tumour(inside, box(), {}));
  EXPECT_THAT(fitted.note, IsEmpty());
  EXPECT_EQ(fitted.surface.vertices, inside.vertices);
}

TEST(FitTumour, WhatSticksOutIsCutAtTheBrainsSurface) {
  const TriangleSurface whole = ball(2.0);
  const auto fitted = value_or_fail(fit_tumour(whole, box(), {}));
  EXPECT_THAT(fitted.note, AllOf(HasSubstr("tumour.ellipsoid"), HasSubstr("by up to 2.0 mm")));
  const geometry::TetLocator locator(box());
  for (int v = 0; v < whole.num_vertices(); ++v) {
    const Vec3 x = fitted.surface.vertices.col(v);
    EXPECT_LE(locator.locate(x).distance_mm, 1e-9);
    const Vec3 before = whole.vertices.col(v);
    if (before.x() <= 40.0) {
      EXPECT_EQ(x, before);
    }
  }
  EXPECT_TRUE(geometry::is_closed(fitted.surface));
  // The volume that is gone is that of a spherical cap of height h: pi h^2 (3 r - h) / 3.
  const double h = 2.0;
  const double cap = std::numbers::pi * h * h * (3.0 * kRadius_mm - h) / 3.0;
  EXPECT_NEAR(geometry::enclosed_volume(whole) - geometry::enclosed_volume(fitted.surface), cap,
              0.05 * cap);
}

TEST(FitTumour, ThreeMillimetresAreCutAndMoreIsRefused) {
  EXPECT_TRUE(fit_tumour(ball(2.99), box(), {}));
  EXPECT_THAT(refusal_of(fit_tumour(ball(3.3), box(), {}), ErrorCode::kInvalidArgument),
              AllOf(HasSubstr("by up to 3.3 mm"), HasSubstr("at most 3 mm are cut")));
}

TEST(FitTumour, AVertexThatIsNoNumberIsRefused) {
  TriangleSurface broken = ball(-1.0);
  broken.vertices(1, 7) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(fit_tumour(broken, box(), {}));
}

}  // namespace
}  // namespace brainshift::anatomy
