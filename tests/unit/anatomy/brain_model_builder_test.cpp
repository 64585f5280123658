// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/config/config_file.hpp"
#include "common/values/model_id.hpp"
#include "tests/support/mesh_figures.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::anatomy {
namespace {

using testing::ball_case;
using testing::kBallCentre;
using testing::kBallRadius_mm;

BrainModel built(const CaseInputs& inputs) {
  auto model = build_brain_model(inputs);
  if (!model) throw std::runtime_error(model.error().message);
  return *model;
}

// The tests below only look, so they share one model.
const BrainModel& ball_model() {
  static const BrainModel model = built(ball_case());
  return model;
}

std::set<NodeIndex> boundary_nodes(const BrainModel& model) {
  const auto nodes = model.boundary_triangles.reshaped();
  return {nodes.begin(), nodes.end()};
}

double mean_edge_near(const TetMesh& mesh, const Vec3& centre, double radius) {
  double sum = 0.0;
  int count = 0;
  for (int t = 0; t < mesh.num_tets(); ++t)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b) {
        const Vec3 x = mesh.nodes.col(mesh.tets(a, t));
        const Vec3 y = mesh.nodes.col(mesh.tets(b, t));
        if ((0.5 * (x + y) - centre).norm() > radius) continue;
        sum += (x - y).norm();
        ++count;
      }
  return sum / count;
}

TEST(BrainModelBuilder, NodeSetsAreDisjointAndTogetherTheBoundary) {
  const BrainModel& model = ball_model();
  std::vector<NodeIndex> all;
  for (const auto* set : {&model.craniotomy, &model.brainstem, &model.slaves, &model.fixed}) {
    EXPECT_FALSE(set->empty());
    EXPECT_TRUE(std::is_sorted(set->begin(), set->end()));
    all.insert(all.end(), set->begin(), set->end());
  }
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
  const std::set<NodeIndex> boundary = boundary_nodes(model);
  EXPECT_EQ(std::vector<NodeIndex>(boundary.begin(), boundary.end()), all);
}

TEST(BrainModelBuilder, MeshIsTheBall) {
  const BrainModel& model = ball_model();
  EXPECT_TRUE(geometry::check_mesh(model.mesh));
  double sum = 0.0;
  const auto boundary = boundary_nodes(model);
  for (const NodeIndex node : boundary) {
    const double radius = (model.mesh.nodes.col(node) - kBallCentre).norm();
    EXPECT_NEAR(radius, kBallRadius_mm, 1.0);  // half a voxel
    sum += radius;
  }
  // Single voxels' errors average out; smoothing shrinks by sigma^2 / r = 0.08 mm.
  EXPECT_NEAR(sum / static_cast<double>(boundary.size()), kBallRadius_mm - 0.08, 0.05);
}

TEST(BrainModelBuilder, CraniotomyIsTheEllipseInTheTangentPlane) {
  const BrainModel& model = ball_model();
  const std::set<NodeIndex> craniotomy(model.craniotomy.begin(), model.craniotomy.end());
  int near_rim = 0;
  for (const NodeIndex node : boundary_nodes(model)) {
    // The ball's normal at the opening is x, so the ellipse's axes are z (long) and y.
    const Vec3 x = model.mesh.nodes.col(node) - kBallCentre;
    const double ellipse = std::hypot(x[2] / 25.0, x[1] / 15.0);
    const bool expected = ellipse <= 1.0 && x[0] > 0.0;
    // The mesh's mean normal is off by up to 2 degrees, 1.5 mm at 50 mm.
    if (x[0] > 0.0 && std::abs(ellipse - 1.0) < 0.1) {
      ++near_rim;
      continue;
    }
    EXPECT_EQ(craniotomy.count(node) == 1, expected) << x.transpose();
  }
  EXPECT_LT(near_rim, static_cast<int>(craniotomy.size()));
}

TEST(BrainModelBuilder, BrainstemIsTheSphere) {
  const BrainModel& model = ball_model();
  const auto config = ball_case().config;
  const std::set<NodeIndex> brainstem(model.brainstem.begin(), model.brainstem.end());
  for (const NodeIndex node : boundary_nodes(model))
    EXPECT_EQ(brainstem.count(node) == 1,
              (model.mesh.nodes.col(node) - config.brainstem.centre_mm).norm() <=
                  config.brainstem.radius_mm);
}

TEST(BrainModelBuilder, FluidPlanePassesThroughTheLowestCraniotomyNode) {
  const BrainModel& model = ball_model();
  const auto depth = [&](NodeIndex n) {
    return model.mesh.nodes.col(n).dot(model.gravity_direction);
  };
  double lowest = -1e9;
  for (const NodeIndex node : model.craniotomy) lowest = std::max(lowest, depth(node));
  EXPECT_EQ(model.fluid_plane_depth_mm, lowest);
  EXPECT_DOUBLE_EQ(model.slave_plane_depth_mm, lowest + 20.0);
  // Gravity is -x: the rim's end on the long axis lies at sqrt(50^2 - 25^2) = 43.3 mm, on the
  // short axis at 47.7; nodes are up to an edge away from the rim.
  EXPECT_GT(-model.fluid_plane_depth_mm - kBallCentre[0], 42.5);
  EXPECT_LT(-model.fluid_plane_depth_mm - kBallCentre[0], 47.7);
  for (const NodeIndex node : model.slaves) EXPECT_LT(depth(node), model.slave_plane_depth_mm);
  for (const NodeIndex node : model.fixed) EXPECT_GE(depth(node), model.slave_plane_depth_mm);
}

TEST(BrainModelBuilder, SkullIsTheBoundaryMovedOutByTheGap) {
  const BrainModel& model = ball_model();
  const TriangleSurface brain = geometry::boundary_surface(model.mesh);
  ASSERT_EQ(model.skull.num_vertices(), brain.num_vertices());
  EXPECT_TRUE(geometry::is_closed(model.skull));
  const Points gap = model.skull.vertices - brain.vertices;
  for (int v = 0; v < gap.cols(); ++v) {
    EXPECT_NEAR(gap.col(v).norm(), 1.0, 1e-12);
    const Vec3 radial = (brain.vertices.col(v) - kBallCentre).normalized();
    EXPECT_GT(gap.col(v).dot(radial), 0.97);  // normals of 8 mm facets on 50 mm: within 14 degrees
  }
}

TEST(BrainModelBuilder, TumourIsTheEllipsoid) {
  const BrainModel& model = ball_model();
  EXPECT_TRUE(geometry::is_closed(model.tumour));
  EXPECT_NEAR(geometry::enclosed_volume(model.tumour), 4.0 / 3.0 * M_PI * 480.0, 20.0);
  const auto volume = value_or_fail(geometry::DistanceVolume::create(model.tumour_distance));
  for (const Vec3 x : model.tumour.vertices.colwise())
    EXPECT_NEAR(volume.at(x).distance_mm, 0.0, 0.05);
}

TEST(BrainModelBuilder, TumourOfThePaperHasAboutItsNumberOfPoints) {
  CaseInputs inputs = ball_case();
  inputs.config.tumour = TumourEllipsoid{kBallCentre + Vec3(15, 0, 0), Vec3(16, 13.5, 12.15)};
  EXPECT_NEAR(built(inputs).tumour.num_vertices(), 2541, 100);
}

TEST(BrainModelBuilder, IsDeterministicAndItsIdIsTheContentHash) {
  const BrainModel& first = ball_model();
  const BrainModel second = built(ball_case());
  EXPECT_EQ(first.model_id, second.model_id);
  EXPECT_EQ(first.model_id, content_hash(first));
  EXPECT_EQ(first.case_id, "ball");
  CaseInputs moved = ball_case();
  std::get<TumourEllipsoid>(moved.config.tumour).centre_mm[0] += 1e-6;
  EXPECT_NE(built(moved).model_id, first.model_id);
}

TEST(BrainModelBuilder, GravityIsNormalised) {
  CaseInputs inputs = ball_case();
  inputs.config.gravity_direction = Vec3(-7, 0, 0);
  const BrainModel model = built(inputs);
  EXPECT_EQ(model.gravity_direction, Vec3(-1, 0, 0));
  EXPECT_EQ(model.slaves, ball_model().slaves);
}

TEST(BrainModelBuilder, RefinesRoundTheTumour) {
  CaseInputs inputs = ball_case();
  auto& mesh = std::get<MeshGeneration>(inputs.config.mesh);
  mesh.tumour_edge_mm = 4.0;
  mesh.tumour_margin_mm = 2.0;
  const Vec3 tumour = std::get<TumourEllipsoid>(inputs.config.tumour).centre_mm;
  const TetMesh refined = built(inputs).mesh;
  EXPECT_NEAR(mean_edge_near(refined, tumour, 9.0), 4.0, 0.6);
  EXPECT_NEAR(mean_edge_near(refined, kBallCentre - Vec3(25, 0, 0), 15.0), 8.0, 1.0);
}

TEST(BrainModelBuilder, RefinesRoundTheCraniotomyRim) {
  CaseInputs inputs = ball_case();
  auto& mesh = std::get<MeshGeneration>(inputs.config.mesh);
  mesh.craniotomy_edge_mm = 4.0;
  mesh.craniotomy_margin_mm = 6.0;
  const TetMesh refined = built(inputs).mesh;
  for (const double end : {-25.0, 25.0})
    EXPECT_NEAR(mean_edge_near(refined, kBallCentre + Vec3(43.3, 0, end), 6.0), 4.0, 0.6);
  EXPECT_NEAR(mean_edge_near(refined, kBallCentre - Vec3(25, 0, 0), 15.0), 8.0, 1.0);
}

TEST(BrainModelBuilder, LabelVolumeGivesTheSurfaceOfEachFocus) {
  CaseInputs inputs = ball_case();
  inputs.config.tumour = TumourLabel{"labels.nii", {3}};
  const Vec3 centre = kBallCentre + Vec3(20, 5, 0), other = centre - Vec3(30, 0, 0);
  auto image = geometry::balls::binary_balls(
      geometry::balls::empty_image(90, centre, Mat3::Identity()), {{centre, 12.0}, {other, 5.0}});
  for (float& v : image.values) v *= 3.0f;
  image.values[0] = 2.0f;  // another label
  inputs.tumour_labels = image;
  std::vector<std::string> notes;
  const TriangleSurface tumour = value_or_fail(build_brain_model(inputs, {}, &notes)).tumour;
  EXPECT_TRUE(geometry::is_closed(tumour));
  for (int v = 0; v < tumour.num_vertices(); ++v) {
    const Vec3 x = tumour.vertices.col(v);
    const double of_large = (x - centre).norm(), of_small = (x - other).norm();
    if (std::abs(of_large - 12.0) < std::abs(of_small - 5.0)) {
      EXPECT_NEAR(of_large, 12.0, 0.5);  // half a voxel
    } else {
      EXPECT_NEAR(of_small, 5.0, 0.7);  // and what smoothing takes of a small ball
    }
  }
  // Smoothing shrinks the radius by sigma^2 / r: 0.08 mm of the large ball, 2 % of the volume.
  const double whole = geometry::balls::ball_volume(12.0) + geometry::balls::ball_volume(5.0);
  EXPECT_NEAR(geometry::enclosed_volume(tumour) / whole, 0.98, 0.02);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_THAT(notes[0], ::testing::HasSubstr("2 parts: 7.2"));
}

TEST(BrainModelBuilder, AGivenTumourSurfaceIsTurnedOutwards) {
  CaseInputs inputs = ball_case();
  const TriangleSurface surface = geometry::ellipsoid_surface(kBallCentre, Vec3(9, 9, 9), 3.0);
  inputs.config.tumour = TumourSurfaceFile{"tumour.stl"};
  for (const auto& given : {surface, testing::inside_out(surface)}) {
    inputs.tumour_surface = given;
    EXPECT_NEAR(geometry::enclosed_volume(built(inputs).tumour), geometry::enclosed_volume(surface),
                1e-9);
  }
}

TEST(BrainModelBuilder, TakesAReadyMeshAsItIs) {
  CaseInputs inputs = ball_case();
  inputs.config.mesh = MeshFile{"ball.msh"};
  inputs.mesh = ball_model().mesh;
  inputs.brain.reset();
  const BrainModel model = built(inputs);
  EXPECT_EQ(model.model_id, ball_model().model_id);
}

TEST(BrainModelBuilder, ThePatientsOwnSkullIsTurnedLikeTheBrain) {
  CaseInputs inputs = ball_case();
  inputs.config.contact.skull_file = "skull.stl";
  const TriangleSurface skull = geometry::ellipsoid_surface(kBallCentre, Vec3(53, 54, 55), 8.0);
  for (const auto& given : {skull, testing::inside_out(skull)}) {
    inputs.skull = given;
    const BrainModel model = built(inputs);
    EXPECT_EQ(model.skull.vertices, skull.vertices);
    EXPECT_GT(geometry::enclosed_volume(model.skull), 0.0);
  }
}

TEST(BrainModelBuilder, ABrainstemOfRadiusZeroSelectsNoNode) {
  CaseInputs inputs = ball_case();
  inputs.config.brainstem.radius_mm = 0.0;
  EXPECT_TRUE(built(inputs).brainstem.empty());
}

TEST(BrainModelBuilder, ReportsProgressUpToTheEnd) {
  std::vector<std::string> stages;
  double fraction = 0.0;
  const auto model = build_brain_model(ball_case(), [&](std::string_view stage, double f) {
    stages.emplace_back(stage);
    EXPECT_TRUE(f >= 0.0 && f <= 1.0);
    fraction = f;
  });
  ASSERT_TRUE(model);
  ASSERT_GE(stages.size(), 5u);
  EXPECT_EQ(stages.front(), "tumour surface");
  EXPECT_EQ(stages.back(), "brain model");
  EXPECT_EQ(fraction, 1.0);
}

// The coarse default case on a real head (Colin27, from Debian's mricron-data).

TEST(RealHead, CoarseDefaultCaseGivesAWholeModel) {
  const auto config = value_or_fail(io::read_case_config(
      std::filesystem::path(BRAINSHIFT_SOURCE_DIR "/config/cases") / "colin27-coarse.yaml"));
  const auto inputs = value_or_fail(io::load_case_inputs(config));
  const auto model = value_or_fail(build_brain_model(inputs));

  const test_support::MeshQuality quality = test_support::mesh_quality(model.mesh);
  // 1,736,387 voxels of 1 mm^3; smoothing and 12 mm facets may change 3 %.
  EXPECT_NEAR(quality.volume_mm3, 1736387.0, 0.03 * 1736387.0);
  EXPECT_NEAR(quality.mean_edge_mm, 12.0, 1.2);
  EXPECT_GT(quality.min_dihedral_deg, 10.0);
  const TriangleSurface brain = geometry::boundary_surface(model.mesh);
  EXPECT_TRUE(geometry::is_closed(brain));
  EXPECT_EQ(
      model.craniotomy.size() + model.brainstem.size() + model.slaves.size() + model.fixed.size(),
      static_cast<std::size_t>(brain.num_vertices()));
  EXPECT_GE(model.craniotomy.size(), 5u);  // 45 x 24 mm over 12 mm edges
  EXPECT_NEAR(geometry::enclosed_volume(model.tumour), 10990.0, 60.0);

  // The craniotomy is on the right; slaves lie above the second plane, fixed nodes below it.
  for (const NodeIndex node : model.craniotomy) EXPECT_GT(model.mesh.nodes(0, node), 50.0);
  const auto depth = [&](NodeIndex node) {
    return model.mesh.nodes.col(node).dot(model.gravity_direction);
  };
  for (const NodeIndex node : model.slaves) EXPECT_LT(depth(node), model.slave_plane_depth_mm);
  for (const NodeIndex node : model.fixed) EXPECT_GE(depth(node), model.slave_plane_depth_mm);
}

}  // namespace
}  // namespace brainshift::anatomy
