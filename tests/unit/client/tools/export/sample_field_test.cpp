// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "client/tools/export/sample_field.hpp"
#include "common/geometry/tet_locator.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

TEST(OutputGrid, LikeAnImageIsItsAffineAsItIs) {
  VoxelImage image;
  image.dims = {4, 5, 6};
  image.T_ras_voxel.linear() =
      Eigen::AngleAxisd(0.4, Vec3::UnitY()).toRotationMatrix() * Vec3(-1, 2, 3).asDiagonal();
  image.T_ras_voxel.translation() = Vec3(7, 8, 9);
  const auto grid = value_or_fail(grid_like(image));
  EXPECT_EQ(grid.dims, image.dims);
  EXPECT_EQ(grid.T_ras_voxel.matrix(), image.T_ras_voxel.matrix());
}

TEST(OutputGrid, AShearedImageIsRefused) {
  VoxelImage image;
  image.dims = {4, 5, 6};
  image.T_ras_voxel.linear()(0, 1) = 0.1;
  EXPECT_THAT(grid_like(image).error().message, HasSubstr("off a right angle"));
}

TEST(OutputGrid, AroundTheBrainHasRoomForTheFieldBeforeAndAfter) {
  const TetMesh mesh = test_support::box_mesh(2, 2, 2, Vec3(40, 50, 60));
  Points u = Points::Zero(3, mesh.num_nodes());
  u.row(0).setConstant(-7.0);
  const OutsideTaper taper{4.0, 10.0};
  const auto grid = value_or_fail(grid_around_brain(mesh, u, 1.5, taper));
  EXPECT_EQ(grid.T_ras_voxel.linear(), 1.5 * Mat3::Identity());
  const Vec3 low = grid.voxel_mm(0, 0, 0);
  const Vec3 high = grid.voxel_mm(grid.dims[0] - 1, grid.dims[1] - 1, grid.dims[2] - 1);
  EXPECT_TRUE((low.array() <= Vec3(-17, -10, -10).array()).all()) << low.transpose();
  EXPECT_TRUE((high.array() >= Vec3(50, 60, 70).array()).all()) << high.transpose();
  EXPECT_TRUE((low.array() > Vec3(-17, -10, -10).array() - 4.0).all()) << low.transpose();
  EXPECT_TRUE((high.array() < Vec3(50, 60, 70).array() + 4.0).all()) << high.transpose();
}

TEST(OutputGrid, ASpacingThatIsNoneOrMakesAHugeGridIsRefused) {
  const TetMesh mesh = test_support::box_mesh(1, 1, 1, Vec3(150, 180, 140));
  const Points u = Points::Zero(3, mesh.num_nodes());
  for (const double bad : {0.0, -1.0, 0.01, 101.0, std::nan(""), 0.3}) {
    const auto grid = grid_around_brain(mesh, u, bad);
    ASSERT_FALSE(grid) << bad;
    EXPECT_EQ(grid.error().code, ErrorCode::kInvalidArgument) << grid.error().message;
  }
}

using io::FieldDirection;

TetMesh brain() {
  return test_support::box_mesh(Vec3::Constant(0.0), Vec3::Constant(40.0), 6, 0.15);
}

// Oblique, anisotropic, flipped; its middle is the brain's.
io::VoxelGrid oblique_grid(const Vec3& spacing = Vec3(1.5, 2.0, 3.0)) {
  io::VoxelGrid grid;
  grid.dims = {55, 45, 30};
  Mat3 axes = (Eigen::AngleAxisd(0.3, Vec3::UnitX()) * Eigen::AngleAxisd(0.5, Vec3::UnitZ()))
                  .toRotationMatrix();
  axes.col(0) *= -1.0;
  grid.T_ras_voxel.linear() = axes * spacing.asDiagonal();
  grid.T_ras_voxel.translation() =
      Vec3::Constant(20.0) - grid.T_ras_voxel.linear() * Vec3(27, 22, 14.5);
  return grid;
}

Points affine_field(const TetMesh& mesh, const Mat3& gradient, const Vec3& shift) {
  return (gradient * mesh.nodes).colwise() + shift;
}

Points curved_field(const TetMesh& mesh) {
  Points u(3, mesh.nodes.cols());
  for (Eigen::Index i = 0; i < u.cols(); ++i) {
    const Vec3 x = mesh.nodes.col(i);
    u.col(i) = Vec3(3 * std::sin(0.08 * x[0]), 2 * std::cos(0.1 * x[1]), 0.002 * x[2] * x[2] - 4);
  }
  return u;
}

Vec3 value(const FieldSamples& samples, std::size_t voxel) {
  const float* v = samples.field.ras_mm.data() + 3 * voxel;
  return {v[0], v[1], v[2]};
}

template <typename Visit>
void for_each_voxel(const io::VoxelGrid& grid, const Visit& visit) {
  for (int k = 0; k < grid.dims[2]; ++k)
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i) visit(grid.voxel_mm(i, j, k), grid.index(i, j, k));
}

bool in_box(const Vec3& x, double margin = 0.0) {
  return x.minCoeff() >= margin && x.maxCoeff() <= 40.0 - margin;
}

constexpr double kFloat_mm = 2e-6;  // millimetres rounded to 32 bits

TEST(SampleField, ModelingIsTheDisplacementAtTheVoxel) {
  const TetMesh mesh = brain();
  Mat3 gradient;
  gradient << 0.05, -0.02, 0.0, 0.01, -0.04, 0.03, 0.0, 0.02, 0.06;
  const Vec3 shift(1, -2, 3);
  const auto samples = value_or_fail(sample_field(mesh, affine_field(mesh, gradient, shift), {},
                                                  oblique_grid(), FieldDirection::kModeling));
  std::size_t inside = 0;
  for_each_voxel(samples.field.grid, [&](const Vec3& x, std::size_t voxel) {
    if (!in_box(x)) return;
    ++inside;
    EXPECT_LT((value(samples, voxel) - (gradient * x + shift)).norm(), kFloat_mm);
  });
  EXPECT_GT(inside, 5000u);
  EXPECT_EQ(samples.voxels_inside, inside);
}

// The inverse of x -> (I + G) x + s is known.
TEST(SampleField, ResamplingIsTheInverseOfAnAffineMap) {
  const TetMesh mesh = brain();
  Mat3 gradient;
  gradient << 0.05, -0.02, 0.0, 0.01, -0.04, 0.03, 0.0, 0.02, 0.06;
  const Vec3 shift(1, -2, 3);
  const Mat3 inverse = (Mat3::Identity() + gradient).inverse();
  const auto samples = value_or_fail(sample_field(mesh, affine_field(mesh, gradient, shift), {},
                                                  oblique_grid(), FieldDirection::kResampling));
  EXPECT_EQ(samples.field.direction, FieldDirection::kResampling);
  std::size_t inside = 0;
  for_each_voxel(samples.field.grid, [&](const Vec3& x, std::size_t voxel) {
    const Vec3 undeformed = inverse * (x - shift);
    if (!in_box(undeformed)) return;
    ++inside;
    EXPECT_LT((x + value(samples, voxel) - undeformed).norm(), kFloat_mm);
  });
  EXPECT_GT(inside, 5000u);
  EXPECT_EQ(samples.voxels_inside, inside);
}

TEST(SampleField, ThereAndBackThroughTheMeshEndsWhereItBegan) {
  const TetMesh mesh = brain();
  const Points u = curved_field(mesh);
  const auto back = sample_field(mesh, u, {}, oblique_grid(), FieldDirection::kResampling).value();
  const geometry::TetLocator undeformed(mesh);
  std::size_t inside = 0;
  double worst_mm = 0.0;
  for_each_voxel(back.field.grid, [&](const Vec3& x, std::size_t voxel) {
    const Vec3 origin = x + value(back, voxel);
    const auto at = undeformed.locate(origin);
    if (at.distance_mm > 0.0 || !in_box(origin, 0.01)) return;
    Vec3 there = origin;
    for (int k = 0; k < 4; ++k) there += at.weights[k] * u.col(at.nodes[k]);
    worst_mm = std::max(worst_mm, (there - x).norm());
    ++inside;
  });
  EXPECT_GT(inside, 5000u);
  EXPECT_LT(worst_mm, 1e-5);  // of 5 mm, in 32 bits
}

TEST(SampleField, OutsideTheBrainTheSurfaceValueFallsToZero) {
  const TetMesh mesh = brain();
  const Vec3 shift(2, 0, 0);
  const OutsideTaper taper{3.0, 9.0};
  for (const auto direction : {FieldDirection::kModeling, FieldDirection::kResampling}) {
    const bool resampling = direction == FieldDirection::kResampling;
    const auto samples = sample_field(mesh, affine_field(mesh, Mat3::Zero(), shift),
                                      {VecX::Ones(mesh.num_nodes()), VecX::Ones(mesh.num_nodes())},
                                      oblique_grid(), direction, taper)
                             .value();
    std::size_t partly = 0, zero = 0;
    for_each_voxel(samples.field.grid, [&](const Vec3& x, std::size_t voxel) {
      const Vec3 in_brain = resampling ? Vec3(x - shift) : x;
      const Vec3 closest = in_brain.cwiseMax(0.0).cwiseMin(40.0);
      const double factor = taper.factor((in_brain - closest).norm());
      const Vec3 expected = (resampling ? -factor : factor) * shift;
      EXPECT_LT((value(samples, voxel) - expected).norm(), 1e-5);
      if (in_box(in_brain)) return;
      partly += factor > 0.0 && factor < 1.0 ? 1 : 0;
      zero += factor == 0.0 ? 1 : 0;
      EXPECT_EQ(samples.sd_mm.values[voxel], 0.0F);
      EXPECT_EQ(samples.known.values[voxel], 0.0F);
      EXPECT_EQ(samples.jacobian.values[voxel], 1.0F);
    });
    EXPECT_GT(partly, 1000u);
    EXPECT_GT(zero, 1000u);
  }
}

TEST(SampleField, UncertaintyAndVolumeRatioComeAlong) {
  const TetMesh mesh = brain();
  const Mat3 gradient = Vec3(0.1, -0.2, 0.0).asDiagonal();
  VecX sd(mesh.num_nodes());
  for (int i = 0; i < sd.size(); ++i) sd[i] = 0.1 + 0.01 * mesh.nodes(0, i);
  const auto samples = sample_field(mesh, affine_field(mesh, gradient, Vec3::Zero()),
                                    {sd, 0.5 * sd}, oblique_grid(), FieldDirection::kResampling)
                           .value();
  for_each_voxel(samples.field.grid, [&](const Vec3& x, std::size_t voxel) {
    const Vec3 undeformed(x[0] / 1.1, x[1] / 0.8, x[2]);
    if (!in_box(undeformed, 0.001)) return;
    EXPECT_NEAR(samples.sd_mm.values[voxel], 0.1 + 0.01 * undeformed[0], 1e-6);
    EXPECT_NEAR(samples.known.values[voxel], 0.05 + 0.005 * undeformed[0], 1e-6);
    EXPECT_NEAR(samples.jacobian.values[voxel], 1.1 * 0.8, 1e-6);
  });
  const auto without = sample_field(mesh, Points::Zero(3, mesh.num_nodes()), {}, oblique_grid(),
                                    FieldDirection::kModeling)
                           .value();
  EXPECT_TRUE(without.sd_mm.values.empty() && without.known.values.empty());
}

TEST(SampleField, VolumeRatiosAreDeterminants) {
  const TetMesh mesh = brain();
  Mat3 gradient;
  gradient << 0.2, 0.1, 0.0, -0.3, 0.1, 0.4, 0.0, 0.2, -0.5;
  const VecX ratios = volume_ratios(mesh, affine_field(mesh, gradient, Vec3(1, 2, 3)));
  const double truth = (Mat3::Identity() + gradient).determinant();
  EXPECT_NEAR(ratios.minCoeff(), truth, 1e-9);
  EXPECT_NEAR(ratios.maxCoeff(), truth, 1e-9);
}

TEST(SampleField, AFoldedFieldHasNoInverseButCanBeLookedAt) {
  const TetMesh mesh = brain();
  const Points u = affine_field(mesh, Vec3(-1.5, 0, 0).asDiagonal().toDenseMatrix(), Vec3::Zero());
  EXPECT_THAT(refusal_of(sample_field(mesh, u, {}, oblique_grid(), FieldDirection::kResampling),
                         ErrorCode::kInvalidArgument),
              HasSubstr("turns 1296 of 1296 elements inside out"));
  const auto there =
      value_or_fail(sample_field(mesh, u, {}, oblique_grid(), FieldDirection::kModeling));
  EXPECT_LT(*std::min_element(there.jacobian.values.begin(), there.jacobian.values.end()), -0.4F);
}

TEST(SampleField, InvalidInputIsRefused) {
  const TetMesh mesh = brain();
  const Points u = Points::Zero(3, mesh.num_nodes());
  const auto code = [&](const Points& field, const io::VoxelGrid& grid, const OutsideTaper& taper) {
    return sample_field(mesh, field, {}, grid, FieldDirection::kModeling, taper).error().code;
  };
  io::VoxelGrid empty = oblique_grid();
  empty.dims[0] = 0;
  EXPECT_EQ(code(u, empty, {}), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(u, oblique_grid(), {5.0, 5.0}), ErrorCode::kInvalidArgument);
  Points bad = u;
  bad(1, 7) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(code(bad, oblique_grid(), {}), ErrorCode::kNotFinite);
}

TEST(SampleField, AGridFarAwayIsZeroAndSaysThatNothingIsInside) {
  const TetMesh mesh = brain();
  io::VoxelGrid grid = oblique_grid();
  grid.T_ras_voxel.translation() += Vec3(500, 0, 0);
  const auto samples = value_or_fail(
      sample_field(mesh, Points::Ones(3, mesh.num_nodes()), {}, grid, FieldDirection::kResampling));
  EXPECT_EQ(samples.voxels_inside, 0u);
  EXPECT_EQ(samples.largest_mm, 0.0);
}

}  // namespace
}  // namespace brainshift::client
