// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <limits>

#include "client/tools/export/warp.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

// v = 3 i + 5 j - 7 k on 1 x 2 x 3 mm voxels.
VoxelImage ramp() {
  VoxelImage image;
  image.dims = {12, 10, 8};
  image.T_ras_voxel.linear() = Vec3(1, 2, 3).asDiagonal();
  image.T_ras_voxel.translation() = Vec3(-5, 4, 2);
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 12; ++i)
        image.values.push_back(static_cast<float>(3 * i + 5 * j - 7 * k));
  return image;
}
double ramp_at(const Vec3& x) { return 3 * (x[0] + 5) + 5 * (x[1] - 4) / 2 - 7 * (x[2] - 2) / 3; }

// One voxel wherever it is wanted.
io::DisplacementField one_voxel(const Vec3& place, const Vec3& v) {
  io::DisplacementField field;
  field.grid.dims = {1, 1, 1};
  field.grid.T_ras_voxel.translation() = place;
  field.ras_mm = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  return field;
}

TEST(WarpImage, AVoxelAsksTheImageWhereItComesFrom) {
  const Vec3 x(0.25, 9, 10), v(1.5, -2.25, 3.0);
  const auto warped = value_or_fail(warp_image(ramp(), one_voxel(x, v)));
  EXPECT_NEAR(warped.values.at(0), ramp_at(x + v), 1e-4);
}

TEST(WarpImage, ALinearImageIsWarpedExactlyOnAnObliqueGrid) {
  io::DisplacementField field;
  field.grid.dims = {6, 5, 4};
  field.grid.T_ras_voxel.linear() =
      Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  field.grid.T_ras_voxel.translation() = Vec3(-2, 8, 8);
  for (std::size_t i = 0; i < 3 * field.grid.num_voxels(); ++i) {
    field.ras_mm.push_back(0.01F * static_cast<float>(i % 70));
  }
  const auto warped = value_or_fail(warp_image(ramp(), field));
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 6; ++i) {
        const std::size_t voxel = field.grid.index(i, j, k);
        const float* v = &field.ras_mm[3 * voxel];
        EXPECT_NEAR(warped.values[voxel],
                    ramp_at(field.grid.voxel_mm(i, j, k) + Vec3(v[0], v[1], v[2])), 1e-4);
      }
}

TEST(WarpImage, HalfAVoxelBeyondTheBorderHasTheBordersValueAndFartherOutZero) {
  const VoxelImage image = ramp();
  io::DisplacementField field = one_voxel({6.4, 4, 2}, Vec3::Zero());  // last voxel at x = 6
  field.grid.dims = {2, 1, 1};                                         // the second at 7.4
  field.ras_mm.resize(6, 0.0F);
  const auto warped = value_or_fail(warp_image(image, field));
  EXPECT_EQ(warped.values[0], 33.0F);
  EXPECT_EQ(warped.values[1], 0.0F);
}

TEST(WarpImage, AVoxelThatIsNotFiniteCountsAsZero) {
  VoxelImage image = ramp();
  image.values[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(warp_image(image, one_voxel({-5, 4, 2}, Vec3::Zero()))->values[0], 0.0F);
  EXPECT_EQ(warp_image(image, one_voxel({-4, 4, 2}, Vec3::Zero()))->values[0], 3.0F);
}

TEST(WarpImage, TheOtherDirectionAndAnImageElsewhereAreRefused) {
  io::DisplacementField field = one_voxel({0, 8, 8}, Vec3::Zero());
  field.direction = io::FieldDirection::kModeling;
  EXPECT_THAT(warp_image(ramp(), field).error().message, HasSubstr("resampling, not modeling"));
  const auto elsewhere = warp_image(ramp(), one_voxel({400, 8, 8}, Vec3::Zero()));
  EXPECT_EQ(elsewhere.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(elsewhere.error().message, HasSubstr("no voxel of the grid lies in the image"));
}

// Linear, so that interpolation is exact.
Points linear_field(const Points& x) {
  Mat3 gradient;
  gradient << 0.05, -0.02, 0.0, 0.01, -0.04, 0.03, 0.0, 0.02, 0.06;
  return (gradient * x).colwise() + Vec3(1, -2, 3);
}
VecX linear_sd(const Points& x) { return (0.01 * x.row(2)).transpose().array() + 0.2; }

void expect_moved(const DeformedSurface& made, const TriangleSurface& before) {
  ASSERT_EQ(made.vertex_fields.size(), 3u);
  EXPECT_EQ(made.vertex_fields[0].name, "displacement_mm");
  EXPECT_EQ(made.vertex_fields[1].name, "sd_mm");
  EXPECT_EQ(made.vertex_fields[2].name, "known");
  EXPECT_EQ(made.surface.triangles, before.triangles);
  const Points u = linear_field(before.vertices);
  EXPECT_LT((made.vertex_fields[0].values - u).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((made.surface.vertices - before.vertices - u).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(
      (made.vertex_fields[1].values.transpose() - linear_sd(before.vertices)).cwiseAbs().maxCoeff(),
      1e-9);
  EXPECT_LT((made.vertex_fields[2].values - 0.5 * made.vertex_fields[1].values).norm(), 1e-9);
}

TEST(DeformedSurface, TumourAndCortexMoveWithTheirField) {
  const BrainModel model = test_support::toy_patient(4);
  const Points u = linear_field(model.mesh.nodes);
  const VecX sd = linear_sd(model.mesh.nodes);
  const Uncertainty of{sd, 0.5 * sd};
  ASSERT_GT(model.tumour.num_vertices(), 20);
  expect_moved(deformed_tumour(model, u, of), model.tumour);
  expect_moved(deformed_triangles(model, model.boundary_triangles, u, of),
               geometry::boundary_surface(model.mesh));
}

TEST(DeformedSurface, WithoutUncertaintyThereIsNoSuchField) {
  const BrainModel model = test_support::toy_patient(3);
  const Points u = Points::Zero(3, model.mesh.num_nodes());
  EXPECT_EQ(deformed_tumour(model, u, {}).vertex_fields.size(), 1u);
  EXPECT_EQ(deformed_triangles(model, model.boundary_triangles, u, {}).vertex_fields.size(), 1u);
}

}  // namespace
}  // namespace brainshift::client
