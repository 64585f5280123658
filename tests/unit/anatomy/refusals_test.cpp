// SPDX-License-Identifier: GPL-3.0-or-later
// Every invalid case is rejected with one line that names the key and the value.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::anatomy {
namespace {

using testing::ball_case;
using ::testing::HasSubstr;
using testing::kBallCentre;

void expect_refused(const CaseInputs& inputs, ErrorCode code,
                    const std::vector<std::string>& parts) {
  const std::string refusal = refusal_of(build_brain_model(inputs), code);
  for (const std::string& part : parts) EXPECT_THAT(refusal, HasSubstr(part));
  EXPECT_EQ(refusal.find('\n'), std::string::npos);
}

// Quick to build: a ready box of 80 mm round the ball's centre.
CaseInputs box_case() {
  CaseInputs inputs = ball_case();
  inputs.config.mesh = MeshFile{"box.msh"};
  inputs.mesh =
      test_support::box_mesh(kBallCentre - Vec3::Constant(40), kBallCentre + Vec3::Constant(40), 8);
  inputs.config.tumour = TumourEllipsoid{kBallCentre + Vec3(20, 0, 0), Vec3(10, 8, 6)};
  inputs.config.craniotomy.centre_mm = kBallCentre + Vec3(41, 3, 2);
  inputs.config.brainstem = {kBallCentre - Vec3(0, 0, 40), 16.0};
  return inputs;
}

TEST(Refusals, TheBoxItselfIsAccepted) {
  const auto model = value_or_fail(build_brain_model(box_case()));
  EXPECT_GT(model.craniotomy.size(), 4u);
}

TEST(Refusals, AnInvalidConfiguration) {
  CaseInputs inputs = box_case();
  inputs.config.contact.gap_mm = -1.0;
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"contact.gap_mm = -1"});
}

TEST(Refusals, AMaskWithoutComponent) {
  CaseInputs inputs = ball_case();
  std::fill(inputs.brain->values.begin(), inputs.brain->values.end(), 0.0f);
  expect_refused(inputs, ErrorCode::kEmptySet, {"images.brain = 'ball.nii'", "no voxel is > 0"});
}

TEST(Refusals, AMaskInMetresOrMicrometres) {
  CaseInputs inputs = ball_case();
  inputs.brain->T_ras_voxel = Eigen::Scaling(1e-3) * inputs.brain->T_ras_voxel;
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"images.brain", "extent 0.09", "metres instead of millimetres"});
  inputs.brain->T_ras_voxel = Eigen::Scaling(1e6) * inputs.brain->T_ras_voxel;
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"images.brain", "between 20 and 400 mm", "micrometres"});
}

TEST(Refusals, FilesThatWereNotRead) {
  CaseInputs inputs = ball_case();
  inputs.brain.reset();
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"images.brain = 'ball.nii'"});
  inputs = box_case();
  inputs.mesh.reset();
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"mesh.file = 'box.msh'"});
  inputs = box_case();
  inputs.config.contact.skull_file = "skull.stl";
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"contact.skull_file = 'skull.stl'"});
  inputs.config.tumour = TumourLabel{"labels.nii", {1}};
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"tumour.label_volume.file"});
  inputs.config.tumour = TumourSurfaceFile{"tumour.stl"};
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"tumour.surface.file"});
}

TEST(Refusals, AMeshInMetres) {
  CaseInputs inputs = box_case();
  inputs.mesh->nodes *= 1e-3;
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"mesh.file = 'box.msh'", "extent 0.08 mm", "metres instead of millimetres"});
}

TEST(Refusals, AMeshWithADefect) {
  CaseInputs inputs = box_case();
  std::swap(inputs.mesh->tets(0, 4), inputs.mesh->tets(1, 4));
  expect_refused(inputs, ErrorCode::kDegenerateMesh,
                 {"mesh.file = 'box.msh'", "tetrahedron 4 is inverted"});
  inputs = box_case();
  inputs.mesh->nodes(0, 3) = std::numeric_limits<double>::quiet_NaN();
  expect_refused(inputs, ErrorCode::kNotFinite, {"mesh.file", "node 3"});
  inputs = box_case();
  inputs.mesh->tets.resize(4, 0);
  expect_refused(inputs, ErrorCode::kEmptySet, {"mesh.file", "no tetrahedron"});
}

TEST(Refusals, ATumourOutsideTheBrain) {
  CaseInputs inputs = box_case();
  std::get<TumourEllipsoid>(inputs.config.tumour).centre_mm = kBallCentre + Vec3(37, 0, 0);
  // Sticks out of the box's face at 40 mm by 7 mm.
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"tumour.ellipsoid", "lie outside the brain", "by up to 7.0 mm"});
}

TEST(Refusals, ALabelThatNoVoxelHas) {
  CaseInputs inputs = box_case();
  inputs.config.tumour = TumourLabel{"labels.nii", {4}};
  inputs.tumour_labels = geometry::balls::binary_balls(
      geometry::balls::empty_image(9, kBallCentre, Mat3::Identity()), {{kBallCentre, 3.0}});
  expect_refused(
      inputs, ErrorCode::kEmptySet,
      {"tumour.label_volume.file = 'labels.nii'", "label = 4", "there are: 1 (0.09 cc)"});
}

TEST(Refusals, ALabelTooSmallForASurface) {
  CaseInputs inputs = box_case();
  inputs.config.tumour = TumourLabel{"labels.nii", {1}};
  inputs.tumour_labels = geometry::balls::empty_image(9, kBallCentre, Mat3::Identity());
  inputs.tumour_labels->values[364] = 1.0f;  // one voxel, smoothed away
  expect_refused(inputs, ErrorCode::kEmptySet,
                 {"tumour.label_volume.file = 'labels.nii'", "too small"});
}

// Smoothed, it is left in pieces of less than a twentieth of it.
TEST(Refusals, ARingTooThinForASurface) {
  CaseInputs inputs = box_case();
  inputs.config.tumour = TumourLabel{"labels.nii", {1}};
  inputs.tumour_labels = geometry::balls::empty_image(48, kBallCentre, Mat3::Identity());
  std::size_t v = 0;
  for (float& value : inputs.tumour_labels->values) {
    const auto voxel = static_cast<double>(v % 48), row = static_cast<double>(v / 48 % 48);
    const auto slice = static_cast<double>(v / (48 * 48));
    const double from_axis = std::hypot(voxel - 23.5, row - 23.5);
    const bool in = std::abs(from_axis - 17.8) < 0.8 && std::abs(slice - 23.5) < 6.0;
    value = in ? 1.0F : 0.0F;
    ++v;
  }
  ::testing::internal::CaptureStderr();
  expect_refused(inputs, ErrorCode::kEmptySet,
                 {"tumour.label_volume.file = 'labels.nii'", "too thin",
                  "nowhere thicker than 2.0 mm, and smoothing by 1.0 mm"});
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Refusals, ATumourSurfaceThatIsNotClosedOrNotWhole) {
  CaseInputs inputs = box_case();
  inputs.config.tumour = TumourSurfaceFile{"tumour.stl"};
  const TriangleSurface whole = geometry::ellipsoid_surface(kBallCentre, Vec3(9, 9, 9), 3.0);
  inputs.tumour_surface = whole;
  inputs.tumour_surface->triangles.conservativeResize(3, whole.num_triangles() - 1);
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"tumour.surface.file = 'tumour.stl'", "closed"});
  inputs.tumour_surface = whole;
  inputs.tumour_surface->triangles(0, 0) = whole.num_vertices();
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"vertex that does not exist"});
  inputs.tumour_surface = whole;
  inputs.tumour_surface->vertices(0, 0) = std::numeric_limits<double>::infinity();
  expect_refused(inputs, ErrorCode::kNotFinite, {"not finite"});
  inputs.tumour_surface = TriangleSurface{};
  expect_refused(inputs, ErrorCode::kEmptySet, {"no triangle"});
}

TEST(Refusals, ATumourSurfaceInMetresOrLps) {
  CaseInputs inputs = box_case();
  inputs.config.tumour = TumourSurfaceFile{"tumour.stl"};
  inputs.tumour_surface = geometry::ellipsoid_surface(kBallCentre, Vec3(9, 9, 9), 3.0);
  inputs.tumour_surface->vertices *= 1e-3;
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"tumour.surface.file = 'tumour.stl'", "extent 0.01", "metres"});
  inputs.tumour_surface =
      geometry::ellipsoid_surface(kBallCentre + Vec3(33, 0, 0), Vec3(5, 5, 5), 3.0);
  inputs.tumour_surface->vertices.topRows<2>() *= -1.0;
  expect_refused(inputs, ErrorCode::kInvalidArgument, {"lie outside the brain", "in LPS instead"});
}

TEST(Refusals, ASkullThatIsNotTheBrains) {
  CaseInputs inputs = ball_case();
  inputs.config.contact.skull_file = "skull.stl";
  const auto skull = [](double radius, const Vec3& at = kBallCentre) {
    return geometry::ellipsoid_surface(at, Vec3::Constant(radius), 8.0);
  };
  const std::string key = "contact.skull_file = 'skull.stl'";
  inputs.skull = skull(53);
  inputs.skull->vertices *= 1e-3;
  expect_refused(inputs, ErrorCode::kInvalidArgument, {key, "skull extent 0.10", "metres"});
  inputs.skull = skull(53);
  for (int t = 0; t < inputs.skull->num_triangles() / 2; ++t)
    std::swap(inputs.skull->triangles(0, t), inputs.skull->triangles(1, t));
  expect_refused(inputs, ErrorCode::kInvalidArgument, {key, "turned inside out"});
  inputs.skull = skull(80);
  expect_refused(inputs, ErrorCode::kInvalidArgument, {key, "mm from the brain", "at most 15"});
  inputs.skull = skull(44);
  expect_refused(inputs, ErrorCode::kInvalidArgument, {key, "stand outside of it, by up to"});
  inputs.skull = skull(53);
  inputs.skull->vertices.topRows<2>() *= -1.0;
  expect_refused(inputs, ErrorCode::kInvalidArgument, {key, "in LPS instead of RAS?"});
}

TEST(Refusals, ACraniotomyFarFromTheBrain) {
  CaseInputs inputs = box_case();
  inputs.config.craniotomy.centre_mm = kBallCentre + Vec3(140, 0, 0);
  expect_refused(
      inputs, ErrorCode::kEmptySet,
      {"craniotomy.centre_mm = [144, -7, 11]", "selects no boundary node", "100.0 mm away"});
  inputs.config.craniotomy.centre_mm = kBallCentre;  // deep inside
  expect_refused(inputs, ErrorCode::kEmptySet, {"craniotomy.centre_mm", "40.0 mm away"});
}

TEST(Refusals, ACraniotomyBetweenTheNodes) {
  CaseInputs inputs = box_case();
  inputs.config.craniotomy.long_axis_mm = 2.0;
  inputs.config.craniotomy.short_axis_mm = 1.0;
  inputs.config.craniotomy.centre_mm = kBallCentre + Vec3(40, 4, 7);
  expect_refused(inputs, ErrorCode::kEmptySet,
                 {"craniotomy.centre_mm", "2 x 1 mm selects no boundary node"});
}

TEST(Refusals, ACraniotomyAxisAcrossTheSurface) {
  CaseInputs inputs = box_case();
  inputs.config.craniotomy.long_axis_direction = Vec3(5, 0, 0);
  expect_refused(inputs, ErrorCode::kInvalidArgument,
                 {"craniotomy.long_axis_direction = [5, 0, 0]", "perpendicular"});
}

TEST(Refusals, ABrainstemThatSelectsNothing) {
  CaseInputs inputs = box_case();
  inputs.config.brainstem.centre_mm = kBallCentre;
  expect_refused(inputs, ErrorCode::kEmptySet, {"brainstem.centre_mm = [4, -7, 11]"});
}

TEST(Refusals, NoSlaveOrNothingFixed) {
  CaseInputs inputs = box_case();
  inputs.config.contact.slave_depth_mm = 300.0;
  expect_refused(inputs, ErrorCode::kEmptySet,
                 {"contact.slave_depth_mm = 300", "nothing is fixed"});
  inputs.config.contact.slave_depth_mm = 0.0;
  // The whole face that looks up is open, so nothing lies above its plane.
  inputs.config.craniotomy.long_axis_mm = 200.0;
  inputs.config.craniotomy.short_axis_mm = 200.0;
  expect_refused(inputs, ErrorCode::kEmptySet, {"contact.slave_depth_mm = 0", "no slave"});
}

TEST(Refusals, ASkullWithoutTriangles) {
  CaseInputs inputs = box_case();
  inputs.config.contact.skull_file = "skull.stl";
  inputs.skull = TriangleSurface{};
  expect_refused(inputs, ErrorCode::kEmptySet, {"contact.skull_file = 'skull.stl'"});
}

}  // namespace
}  // namespace brainshift::anatomy
