// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "tests/support/toy_patient.hpp"

namespace brainshift::registration {
namespace {

TEST(CraniotomyPatch, HoldsTheBoundaryTrianglesBetweenCraniotomyNodes) {
  const BrainModel patient = test_support::toy_patient(8);
  const SurfacePatch patch = craniotomy_patch(patient);
  ASSERT_GT(patch.surface.num_triangles(), 4);
  EXPECT_EQ(patch.nodes.size(), patient.craniotomy.size());
  for (int t = 0; t < patch.surface.num_triangles(); ++t) {
    const auto corners = patch.surface.triangles.col(t);
    const Vec3 a = patch.surface.vertices.col(corners[0]);
    const Vec3 n = (Vec3(patch.surface.vertices.col(corners[1])) - a)
                       .cross(Vec3(patch.surface.vertices.col(corners[2])) - a);
    EXPECT_GT(n.z(), 0.0) << "outwards is up";
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(patch.surface.vertices.col(corners[k]),
                patient.mesh.nodes.col(patch.nodes[static_cast<std::size_t>(corners[k])]));
    }
  }
  EXPECT_EQ(craniotomy_patch(BrainModel{}).surface.num_triangles(), 0);
}

TEST(CraniotomyPatch, MovesWithItsNodes) {
  const SurfacePatch patch = craniotomy_patch(test_support::toy_patient(8));
  const Points u = Points::Random(3, static_cast<Eigen::Index>(patch.nodes.size()));
  EXPECT_EQ(Points(u * patch.weights), u);
}

TEST(TumourPatch, MovesAsTheTissueAroundItsVertices) {
  const BrainModel patient = test_support::toy_patient(8);
  const SurfacePatch patch = tumour_patch(patient);
  EXPECT_EQ(patch.surface.vertices, patient.tumour.vertices);
  EXPECT_EQ(patch.surface.triangles, patient.tumour.triangles);
  EXPECT_TRUE(std::is_sorted(patch.nodes.begin(), patch.nodes.end()));
  EXPECT_LT(patch.nodes.size(), static_cast<std::size_t>(patient.mesh.num_nodes()) / 2);
  // Linear elements carry a linear field exactly.
  Mat3 gradient;
  gradient << 0.1, -0.3, 0.2, 0.05, 0.2, -0.1, 0.0, 0.4, -0.2;
  const Points u =
      (gradient * patient.mesh.nodes(Eigen::all, patch.nodes)).colwise() + Vec3(1, 2, 3);
  const Points expected = (gradient * patient.tumour.vertices).colwise() + Vec3(1, 2, 3);
  EXPECT_LT((u * patch.weights - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(TumourPatch, VerticesOutsideTheMeshMoveWithItsClosestPoint) {
  BrainModel patient = test_support::toy_patient(8);
  patient.tumour.vertices.row(2).array() += 18.0;  // its top is 8 mm above the brain's
  const SurfacePatch patch = tumour_patch(patient);
  const Points heights = patient.mesh.nodes(Eigen::all, patch.nodes);
  const Points seen = heights * patch.weights;
  for (int v = 0; v < patch.surface.num_vertices(); ++v) {
    EXPECT_NEAR(seen(2, v), std::min(60.0, patch.surface.vertices(2, v)), 1e-9);
  }
}

}  // namespace
}  // namespace brainshift::registration
