// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mesh_generation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/geometry/mask.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/mesh_figures.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/geometry/ball_mask.hpp"

namespace brainshift::geometry {
namespace {

using test_support::mesh_quality;
using test_support::MeshQuality;

using balls::Ball;

SizingField uniform(double edge) {
  return [edge](const Vec3&) { return edge; };
}

// A ball of radius 20 mm, off the origin, in an oblique left-handed frame with 1.5 mm voxels.
const Ball kBall{Vec3(30, -10, 45), 20.0};
VoxelImage ball_mask() {
  return balls::soft_balls(
      balls::empty_image(36, kBall.centre + Vec3(0.3, -0.4, 0.2), balls::oblique_left_handed(1.5)),
      {kBall}, 6.0);
}

TetMesh meshed(const VoxelImage& mask, const SizingField& edge) {
  auto mesh = mesh_mask(mask, edge);
  if (!mesh) throw std::runtime_error(mesh.error().message);
  return *mesh;
}

long euler_characteristic(const TriangleSurface& surface) {
  std::set<std::pair<int, int>> edges;
  for (int t = 0; t < surface.num_triangles(); ++t)
    for (int a = 0; a < 3; ++a)
      edges.insert(std::minmax(surface.triangles(a, t), surface.triangles((a + 1) % 3, t)));
  return surface.num_vertices() - static_cast<long>(edges.size()) + surface.num_triangles();
}

TEST(MeshMask, BoundaryNodesLieOnTheSphere) {
  const TriangleSurface surface = boundary_surface(meshed(ball_mask(), uniform(4.0)));
  for (int v = 0; v < surface.num_vertices(); ++v) {
    const double radius = (surface.vertices.col(v) - kBall.centre).norm();
    // Trilinear interpolation misses the sphere by at most 3 h^2 / (8 r) = 0.04 mm.
    EXPECT_NEAR(radius, kBall.radius, 0.045) << v;
  }
}

TEST(MeshMask, VolumeIsTheBallsLessTheSagOfItsFacets) {
  const TetMesh mesh = meshed(ball_mask(), uniform(4.0));
  const double volume = mesh_quality(mesh).volume_mm3;
  // A facet with circumradius c = edge / sqrt(3) sags by c^2 / (2 r); the whole surface by less.
  const double sag = 4.0 * 4.0 / 3.0 / (2.0 * kBall.radius);
  EXPECT_LT(volume, balls::ball_volume(kBall.radius) * 1.002);
  EXPECT_GT(volume, balls::ball_volume(kBall.radius) * (1.0 - 3.0 * sag / kBall.radius));
}

TEST(MeshMask, SurfaceIsAClosedSphere) {
  const TetMesh mesh = meshed(ball_mask(), uniform(5.0));
  const TriangleSurface surface = boundary_surface(mesh);
  EXPECT_TRUE(is_closed(surface));
  EXPECT_EQ(euler_characteristic(surface), 2);
  EXPECT_NEAR(enclosed_volume(surface), mesh_quality(mesh).volume_mm3, 1e-6);
}

TEST(MeshMask, MeanEdgeIsTheTarget) {
  for (const double edge : {3.0, 4.5}) {
    const MeshQuality quality = mesh_quality(meshed(ball_mask(), uniform(edge)));
    // Calibrated to 2 % on a head; a small ball has more surface per volume.
    EXPECT_NEAR(quality.mean_edge_mm, edge, 0.1 * edge);
    EXPECT_LT(quality.max_edge_mm, 2.0 * edge);
  }
}

TEST(MeshMask, TetrahedraAreWellShapedAndPositive) {
  const TetMesh mesh = meshed(ball_mask(), uniform(4.0));
  EXPECT_TRUE(check_mesh(mesh));
  const MeshQuality quality = mesh_quality(mesh);
  EXPECT_GT(quality.min_dihedral_deg, 10.0);
  EXPECT_LT(quality.max_dihedral_deg, 168.0);
}

TEST(MeshMask, WithoutSliverBoundLeavesOptimisationOut) {
  std::vector<std::string> stages;
  MeshingOptions options;
  options.sliver_bound_deg = 0.0;
  const auto mesh =
      value_or_fail(mesh_mask(ball_mask(), uniform(4.0), options,
                              [&](std::string_view stage, double) { stages.emplace_back(stage); }));
  EXPECT_EQ(stages, (std::vector<std::string>{"mesh: refine", "mesh: done"}));
  EXPECT_LT(mesh_quality(mesh).min_dihedral_deg, 10.0);  // what the optimisation is for
}

TEST(MeshMask, RefinesWhereTheSizingFieldIsSmall) {
  const auto graded = [](const Vec3& x) { return x[0] < kBall.centre[0] ? 2.5 : 6.0; };
  const TetMesh mesh = meshed(ball_mask(), graded);
  double sum[2] = {0, 0};
  int count[2] = {0, 0};
  for (int t = 0; t < mesh.num_tets(); ++t)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b) {
        const Vec3 x = mesh.nodes.col(mesh.tets(a, t));
        const Vec3 y = mesh.nodes.col(mesh.tets(b, t));
        const double middle = 0.5 * (x[0] + y[0]) - kBall.centre[0];
        if (std::abs(middle) < 4.0) continue;  // the transition
        const int side = middle > 0.0 ? 1 : 0;
        sum[side] += (x - y).norm();
        ++count[side];
      }
  EXPECT_NEAR(sum[0] / count[0], 2.5, 0.35);
  EXPECT_NEAR(sum[1] / count[1], 6.0, 1.2);
}

TEST(MeshMask, IsBitIdenticalWhenRepeated) {
  const VoxelImage mask = ball_mask();
  const TetMesh first = meshed(mask, uniform(4.0));
  const TetMesh other = meshed(mask, uniform(6.0));  // uses up random numbers in between
  const TetMesh second = meshed(mask, uniform(4.0));
  EXPECT_NE(other.num_nodes(), first.num_nodes());
  ASSERT_EQ(first.nodes.cols(), second.nodes.cols());
  ASSERT_EQ(first.tets.cols(), second.tets.cols());
  EXPECT_TRUE((first.nodes.array() == second.nodes.array()).all());
  EXPECT_TRUE((first.tets.array() == second.tets.array()).all());
}

TEST(MeshMask, NeighboursInSpaceAreNeighboursInMemory) {
  const TetMesh mesh = meshed(ball_mask(), uniform(3.0));
  double sum = 0.0;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    EXPECT_EQ(mesh.tets.col(t).minCoeff(), mesh.tets(0, t));
    EXPECT_LE(mesh.tets(0, std::max(0, t - 1)), mesh.tets(0, t));
    sum += mesh.tets.col(t).maxCoeff() - mesh.tets(0, t);
  }
  // Four random numbers below n differ by 0.6 n on average.
  EXPECT_LT(sum / mesh.num_tets(), 0.3 * mesh.num_nodes());
}

TEST(MeshMask, KeepsOnlyTheLargestPart) {
  const Ball large{Vec3(-12, 0, 0), 14.0};
  const Ball small{Vec3(16, 0, 0), 8.0};
  const VoxelImage mask = balls::soft_balls(
      balls::empty_image(48, Vec3::Zero(), 1.5 * Mat3::Identity()), {large, small}, 3.0);
  const TetMesh mesh = meshed(mask, uniform(4.0));
  EXPECT_TRUE(check_mesh(mesh));
  const Points offsets = mesh.nodes.colwise() - large.centre;
  EXPECT_LT(offsets.colwise().norm().maxCoeff(), large.radius + 0.5);
}

TEST(MeshMask, ADomainThatFillsTheImageIsClosedAtItsBorder) {
  VoxelImage mask = balls::empty_image(12, Vec3(5, 5, 5), 2.0 * Mat3::Identity());
  std::fill(mask.values.begin(), mask.values.end(), 1.0f);
  const TetMesh mesh = meshed(mask, uniform(4.0));
  EXPECT_TRUE(is_closed(boundary_surface(mesh)));
  // A cube of 12 voxels: the half level lies half a voxel outside the outermost centres; facets
  // cut its edges and corners by up to 0.15 x 4 mm.
  EXPECT_NEAR(mesh_quality(mesh).volume_mm3, 24.0 * 24.0 * 24.0, 0.06 * 24 * 24 * 24);
}

TEST(MeshMask, OneVoxelIsADomainToo) {
  VoxelImage mask = balls::empty_image(5, Vec3::Zero(), 10.0 * Mat3::Identity());
  mask.values[62] = 1.0f;
  const TetMesh mesh = meshed(mask, uniform(4.0));
  EXPECT_TRUE(is_closed(boundary_surface(mesh)));
}

TEST(MeshMask, AnEdgeLongerThanTheDomainGivesAMeshOrASentence) {
  const auto mesh = mesh_mask(ball_mask(), uniform(300.0));
  if (mesh) {
    EXPECT_TRUE(check_mesh(*mesh));
  } else {
    EXPECT_FALSE(mesh.error().message.empty());
  }
}

TEST(MeshMask, AnEmptyDomainIsAnError) {
  VoxelImage mask = balls::empty_image(5, Vec3::Zero(), Mat3::Identity());
  std::fill(mask.values.begin(), mask.values.end(), 0.5f);  // nowhere above the level
  for (const VoxelImage& image : {mask, VoxelImage{}}) {
    EXPECT_THAT(refusal_of(mesh_mask(image, uniform(4.0)), ErrorCode::kEmptySet),
                testing::HasSubstr("0.5"));
  }
}

TEST(MeshMask, ReportsEachStageInOrder) {
  std::vector<std::string> stages;
  double last = 0.0;
  const auto mesh = mesh_mask(ball_mask(), uniform(6.0), {}, [&](std::string_view s, double f) {
    stages.emplace_back(s);
    EXPECT_GE(f, last);
    last = f;
  });
  ASSERT_TRUE(mesh);
  EXPECT_EQ(stages, (std::vector<std::string>{"mesh: refine", "mesh: perturb", "mesh: exude",
                                              "mesh: done"}));
  EXPECT_EQ(last, 1.0);
}

}  // namespace
}  // namespace brainshift::geometry
