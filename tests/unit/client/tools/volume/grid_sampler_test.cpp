// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/volume/grid_sampler.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <set>

#include "tests/support/box_mesh.hpp"

namespace brainshift::client {
namespace {

using geometry::TetLocator;

constexpr double kFloat = 2e-6;  // a field of some mm, rounded to 32 bits
constexpr double kLow = 0.0, kHigh = 40.0;

TetMesh brain() {
  return test_support::box_mesh(Vec3::Constant(kLow), Vec3::Constant(kHigh), 8, 0.15);
}

Vec3 linear_field(const Vec3& x) {
  return Vec3(1.0 + 0.05 * x[0] - 0.02 * x[2], 0.03 * x[1], -2.0 + 0.04 * x[0] + 0.01 * x[1]);
}
Vec3 curved_field(const Vec3& x) {
  return Vec3(3.0 * std::sin(0.08 * x[0]), 2.0 * std::cos(0.1 * x[1]), 0.002 * x[2] * x[2]);
}

template <typename Field>
Points at_nodes(const TetMesh& mesh, const Field& field) {
  Points u(3, mesh.nodes.cols());
  for (Eigen::Index i = 0; i < u.cols(); ++i) u.col(i) = field(mesh.nodes.col(i));
  return u;
}

bool in_rim(const FieldGrid& grid, int i, int j, int k) {
  const std::array<int, 3> voxel = {i, j, k};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (voxel[axis] == 0 || voxel[axis] == grid.dims[axis] - 1) return true;
  }
  return false;
}

// What a viewer makes of the voxels, written anew.
Vec3 shown_at(const FieldGrid& grid, const std::vector<float>& xyz, const Vec3& x) {
  const Vec3 place = (x - grid.origin_mm) / grid.spacing_mm;
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const Vec3 away = (place - Vec3(i, j, k)).cwiseAbs();
        if (away.maxCoeff() >= 1.0) continue;
        const double weight = (1 - away[0]) * (1 - away[1]) * (1 - away[2]);
        const std::size_t first = 3 * grid.index(i, j, k);
        sum += weight * Vec3(xyz[first], xyz[first + 1], xyz[first + 2]);
      }
    }
  }
  return sum;
}

struct Sampled {
  GridSampler sampler;
  std::vector<float> xyz;
};
Sampled sampled(const TetMesh& mesh, const Points& u, const FieldGrid& grid,
                const SamplerOptions& options = {}) {
  auto sampler = GridSampler::build(TetLocator(mesh), grid, options).value();
  // Whatever stood there before must go.
  std::vector<float> xyz(3 * grid.num_voxels(), 99.0F);
  sampler.sample(u, xyz.data());
  return {std::move(sampler), std::move(xyz)};
}

Vec3 vector_at(const std::vector<float>& xyz, std::size_t voxel) {
  return Vec3(xyz[3 * voxel], xyz[3 * voxel + 1], xyz[3 * voxel + 2]);
}

double outside_mm(const Vec3& x) {
  const Vec3 nearest = x.cwiseMax(kLow).cwiseMin(kHigh);
  return (x - nearest).norm();
}

// A linear field is the same in tetrahedra and in voxels: inside, everything is exact. Outside, the
// closest point of a box is known.
TEST(GridSampler, ALinearFieldIsExactInTheBrainAndTapersOutsideOfIt) {
  const TetMesh mesh = brain();
  const FieldGrid grid = grid_around(mesh.nodes, 24.0, 2.5).value();
  const auto [sampler, xyz] = sampled(mesh, at_nodes(mesh, linear_field), grid);
  const OutsideTaper taper;
  int inside = 0, tapered = 0;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const Vec3 x = grid.voxel_mm(i, j, k);
        const double away_mm = outside_mm(x);
        const Vec3 expected =
            in_rim(grid, i, j, k)
                ? Vec3(Vec3::Zero())
                : Vec3(taper.factor(away_mm) * linear_field(x.cwiseMax(kLow).cwiseMin(kHigh)));
        const Vec3 got = vector_at(xyz, grid.index(i, j, k));
        ASSERT_LT((got - expected).norm(), kFloat) << x.transpose();
        inside += away_mm == 0.0 ? 1 : 0;
        tapered += away_mm > taper.full_mm && away_mm < taper.zero_mm ? 1 : 0;
      }
    }
  }
  EXPECT_GT(inside, 3000);
  EXPECT_GT(tapered, 3000);
}

TEST(GridSampler, NodesLandWithinTheStatedErrorAndTheErrorIsNoLargerThanNeeded) {
  const TetMesh mesh = brain();
  const Points u = at_nodes(mesh, curved_field);
  for (const double spacing_mm : {1.3, 2.0, 5.0}) {
    const FieldGrid grid = grid_around(mesh.nodes, 6.0, spacing_mm).value();
    const auto [sampler, xyz] = sampled(mesh, u, grid);
    ASSERT_EQ(sampler.interior().size(), static_cast<std::size_t>(mesh.nodes.cols()));
    const double stated_mm = sampler.interpolation_error_mm(u, xyz.data());
    double worst_mm = 0.0;
    for (const NodeIndex node : sampler.interior()) {
      worst_mm =
          std::max(worst_mm, (shown_at(grid, xyz, mesh.nodes.col(node)) - u.col(node)).norm());
    }
    EXPECT_NEAR(stated_mm, worst_mm, kFloat);
    EXPECT_GT(stated_mm, 1e-3) << "a curved field is not the same in voxels";
    EXPECT_LT(stated_mm, 0.2 * spacing_mm);
  }
}

TEST(GridSampler, OnlyTheRimIsZeroWhereAGridEndsInTheBrain) {
  const TetMesh mesh = brain();
  const FieldGrid grid{{7, 8, 9}, Vec3::Constant(11.0), 2.0};
  const auto constant = [](const Vec3&) { return Vec3(1, -2, 3); };
  const auto [sampler, xyz] = sampled(mesh, at_nodes(mesh, constant), grid);
  for (int k = 0; k < 9; ++k) {
    for (int j = 0; j < 8; ++j) {
      for (int i = 0; i < 7; ++i) {
        const Vec3 got = vector_at(xyz, grid.index(i, j, k));
        EXPECT_EQ(got.isZero(0.0), in_rim(grid, i, j, k));
        if (!in_rim(grid, i, j, k)) {
          EXPECT_LT((got - Vec3(1, -2, 3)).norm(), kFloat);
        }
      }
    }
  }
  for (const NodeIndex node : sampler.interior()) {
    const Vec3 x = mesh.nodes.col(node);
    EXPECT_TRUE((x.array() >= (grid.origin_mm.array() + 4.0)).all());
    EXPECT_TRUE((x.array() <= (grid.last_mm().array() - 4.0)).all());
  }
  EXPECT_EQ(sampler.interpolation_error_mm(at_nodes(mesh, constant), xyz.data()) < kFloat, true);
}

TEST(GridSampler, TheFadeFallsToZeroTowardsTheRimAndLeavesTheInteriorAlone) {
  const TetMesh mesh = brain();
  const FieldGrid grid{{31, 31, 31}, Vec3::Constant(5.0), 1.0};
  const auto constant = [](const Vec3&) { return Vec3(4, 0, 0); };
  const Points u = at_nodes(mesh, constant);
  const auto [sampler, xyz] = sampled(mesh, u, grid, {.fade_mm = 10.0});
  for (int i = 0; i < 31; ++i) {
    const double rim_mm = std::min(i, 30 - i);
    const double expected =
        rim_mm >= 10.0 ? 4.0 : 2.0 * (1.0 - std::cos(3.14159265358979 * rim_mm / 10.0));
    EXPECT_NEAR(vector_at(xyz, grid.index(i, 15, 15))[0], expected, kFloat) << i;
  }
  EXPECT_FALSE(sampler.interior().empty());
  EXPECT_LT(sampler.interpolation_error_mm(u, xyz.data()), kFloat);
}

TEST(GridSampler, AScalarIsZeroOutsideOfTheBrainAndIsNotFaded) {
  const TetMesh mesh = brain();
  const FieldGrid grid = grid_around(mesh.nodes, 10.0, 3.0).value();
  const auto sampler = GridSampler::build(TetLocator(mesh), grid, {.fade_mm = 20.0}).value();
  const VecX sd = 0.5 + 0.01 * mesh.nodes.row(0).transpose().array();
  std::vector<float> out(grid.num_voxels(), 99.0F);
  sampler.sample_scalar(sd, out.data());
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const Vec3 x = grid.voxel_mm(i, j, k);
        const bool inside = outside_mm(x) == 0.0 && !in_rim(grid, i, j, k);
        EXPECT_NEAR(out[grid.index(i, j, k)], inside ? 0.5 + 0.01 * x[0] : 0.0, kFloat);
      }
    }
  }
}

// Nodes that no voxel needs may hold anything: a viewer receives the others only.
TEST(GridSampler, DependsOnTheNodesThatItNamesAndOnNoOthers) {
  const TetMesh mesh = brain();
  const FieldGrid grid{{6, 6, 6}, Vec3::Constant(12.0), 2.0};
  const Points u = at_nodes(mesh, curved_field);
  const auto [sampler, xyz] = sampled(mesh, u, grid);
  const std::set<NodeIndex> used(sampler.nodes_used().begin(), sampler.nodes_used().end());
  EXPECT_LT(used.size(), static_cast<std::size_t>(mesh.nodes.cols()) / 2);
  Points partial = Points::Constant(3, u.cols(), std::numeric_limits<double>::quiet_NaN());
  for (const NodeIndex node : used) partial.col(node) = u.col(node);
  std::vector<float> again(xyz.size());
  sampler.sample(partial, again.data());
  EXPECT_EQ(again, xyz);
  EXPECT_EQ(sampler.interpolation_error_mm(partial, again.data()),
            sampler.interpolation_error_mm(u, xyz.data()));
}

TEST(GridSampler, RefusesWhatItCannotSample) {
  const TetLocator mesh(brain());
  const FieldGrid grid{{4, 4, 4}, Vec3::Zero(), 1.0};
  const auto code = [&](const TetLocator& locator, const FieldGrid& on, const SamplerOptions& how) {
    const auto made = GridSampler::build(locator, on, how);
    return made ? ErrorCode::kInternal : made.error().code;
  };
  EXPECT_EQ(code(TetLocator(TetMesh{}), grid, {}), ErrorCode::kEmptySet);
  EXPECT_EQ(code(mesh, FieldGrid{{2, 4, 4}, Vec3::Zero(), 1.0}, {}), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(mesh, grid, {.taper = {5.0, 4.0}}), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(mesh, grid, {.fade_mm = -1.0}), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(mesh, grid, {.fade_mm = std::nan("")}), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace brainshift::client
