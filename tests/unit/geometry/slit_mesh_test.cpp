// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/slit_mesh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/mesh_figures.hpp"

namespace brainshift::geometry {
namespace {

// A box of 40 mm in cells of 10 mm.
TetMesh box_of_cells() { return test_support::box_mesh(4, 4, 4, Vec3::Constant(40.0)); }

std::vector<char> none_of(const TetMesh& mesh) {
  return std::vector<char>(static_cast<std::size_t>(mesh.num_tets()), 0);
}

// Inner faces in the plane component `axis` = 20 mm whose centre `holds`.
template <typename Holds>
Facets facets_in_plane(const TetMesh& mesh, int axis, const Holds& holds) {
  std::set<std::array<int, 3>> found;
  for (const MeshFace& face : sorted_faces(mesh.tets)) {
    Vec3 centre = Vec3::Zero();
    bool in_plane = true;
    for (const int n : face.nodes) {
      centre += mesh.nodes.col(n) / 3.0;
      in_plane = in_plane && mesh.nodes(axis, n) == 20.0;
    }
    if (in_plane && holds(centre)) found.insert(face.nodes);
  }
  return {found.begin(), found.end()};
}

SlitMesh upper_slit() {
  const TetMesh mesh = box_of_cells();
  const Facets facets = facets_in_plane(mesh, 0, [](const Vec3& x) { return x[2] > 20.0; });
  return cut_mesh(mesh, none_of(mesh), facets, std::vector<int>(facets.size(), 0));
}

TEST(SlitMesh, DoublesTheNodesOfTheSlitButThoseOfItsFreeEdge) {
  const TetMesh mesh = box_of_cells();
  const SlitMesh cut = upper_slit();
  ASSERT_EQ(cut.copies.size(), static_cast<std::size_t>(mesh.num_nodes()));
  int doubled = 0;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const Vec3 x = mesh.nodes.col(n);
    const bool inside = x[0] == 20.0 && x[2] > 20.0;
    EXPECT_EQ(cut.copies[static_cast<std::size_t>(n)].size(), inside ? 2u : 1u) << x.transpose();
    for (const int copy : cut.copies[static_cast<std::size_t>(n)])
      EXPECT_EQ(cut.mesh.nodes.col(copy), x);
    doubled += inside ? 1 : 0;
  }
  EXPECT_EQ(doubled, 10);
  EXPECT_EQ(cut.mesh.num_nodes(), mesh.num_nodes() + doubled);
  EXPECT_TRUE(check_mesh(cut.mesh).has_value());
  EXPECT_NEAR(test_support::mesh_quality(cut.mesh).volume_mm3, 64000.0, 1e-8);
}

TEST(SlitMesh, EachSideHasItsOwnNodesAndNormalsIntoIt) {
  const SlitMesh cut = upper_slit();
  ASSERT_EQ(cut.side_nodes.size(), 20u);
  std::vector<double> sides(static_cast<std::size_t>(cut.mesh.num_nodes()), 0.0);
  for (int t = 0; t < cut.mesh.num_tets(); ++t) {
    double centre = 0.0;
    for (int k = 0; k < 4; ++k) centre += 0.25 * cut.mesh.nodes(0, cut.mesh.tets(k, t));
    for (int k = 0; k < 4; ++k) {
      double& side = sides[static_cast<std::size_t>(cut.mesh.tets(k, t))];
      side = centre > 20.0 ? 1.0 : -1.0;
    }
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < cut.side_nodes.size(); ++i) {
    const Vec3 normal = cut.side_normals.col(static_cast<Eigen::Index>(i));
    const double side = sides[static_cast<std::size_t>(cut.side_nodes[i])];
    EXPECT_LT((normal - side * Vec3::UnitX()).norm(), 1e-14);
    sum += side;
  }
  EXPECT_EQ(sum, 0.0);
  EXPECT_DOUBLE_EQ(area({cut.mesh.nodes, cut.sheets}), 2.0 * 800.0);
}

TEST(SlitMesh, TheOuterSurfaceKeepsItsTriangles) {
  const TetMesh mesh = box_of_cells();
  const SlitMesh cut = upper_slit();
  const auto before = boundary_triangles(mesh);
  ASSERT_EQ(cut.outer.cols(), before.cols());
  const TriangleSurface surface{cut.mesh.nodes, cut.outer};
  EXPECT_NEAR(enclosed_volume(surface), 64000.0, 1e-8);
  // Every other boundary triangle belongs to one side of the slit: 16 triangles, twice.
  EXPECT_EQ(boundary_triangles(cut.mesh).cols(), before.cols() + cut.sheets.cols());
}

// Two slits that meet in a line: three bodies meet there, and each has its own nodes.
TEST(SlitMesh, SlitsThatMeetPartThreeSides) {
  const TetMesh mesh = box_of_cells();
  Facets facets = facets_in_plane(mesh, 2, [](const Vec3&) { return true; });
  std::vector<int> group(facets.size(), 1);
  const Facets falx = facets_in_plane(mesh, 0, [](const Vec3& x) { return x[2] > 20.0; });
  facets.insert(facets.end(), falx.begin(), falx.end());
  group.resize(facets.size(), 0);
  const SlitMesh cut = cut_mesh(mesh, none_of(mesh), facets, group);
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const Vec3 x = mesh.nodes.col(n);
    const std::size_t expected = x[2] == 20.0                  ? (x[0] == 20.0 ? 3u : 2u)
                                 : x[2] > 20.0 && x[0] == 20.0 ? 2u
                                                               : 1u;
    EXPECT_EQ(cut.copies[static_cast<std::size_t>(n)].size(), expected) << x.transpose();
  }
  // 25 nodes on the floor: 20 of them doubled, 5 tripled; of these two touch both sheets.
  EXPECT_EQ(cut.side_nodes.size(), 20u * 2 + 5u * (1 + 2 * 2) + 10u * 2);
}

TEST(SlitMesh, WhatIsTakenOutLeavesAWallThatLooksIntoTheCavity) {
  TetMesh mesh = box_of_cells();
  std::vector<char> taken = none_of(mesh);
  double volume = 0.0;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    mesh.labels.push_back(t);
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centre += 0.25 * mesh.nodes.col(mesh.tets(k, t));
    if ((centre - Vec3::Constant(20.0)).cwiseAbs().maxCoeff() > 10.0) continue;
    taken[static_cast<std::size_t>(t)] = 1;
    volume += tet_volume(mesh, t);
  }
  const SlitMesh cut = cut_mesh(mesh, taken, {}, {});
  EXPECT_NEAR(volume, 8000.0, 1e-9);
  const TriangleSurface wall{cut.mesh.nodes, cut.wall};
  EXPECT_TRUE(is_closed(wall));
  EXPECT_NEAR(enclosed_volume(wall), -volume, 1e-9);
  const Points outwards = 0.1 * (cut.mesh.nodes.colwise() - Vec3::Constant(20.0));
  EXPECT_NEAR(growth_of_cavity(wall, outwards), (1.331 - 1.0) * volume, 1e-8);
  EXPECT_NEAR(growth_of_cavity(wall, -outwards), (0.729 - 1.0) * volume, 1e-8);
  EXPECT_NEAR(test_support::mesh_quality(cut.mesh).volume_mm3, 64000.0 - volume, 1e-9);
  EXPECT_EQ(cut.mesh.num_nodes(), mesh.num_nodes() - 1);  // the one in the middle
  EXPECT_TRUE(check_mesh(cut.mesh).has_value());
  for (int t = 0; t < cut.mesh.num_tets(); ++t) {
    const int old = cut.mesh.labels[static_cast<std::size_t>(t)];
    EXPECT_FALSE(taken[static_cast<std::size_t>(old)]);
    EXPECT_EQ(cut.mesh.nodes.col(cut.mesh.tets(0, t)), mesh.nodes.col(mesh.tets(0, old)));
  }
}

}  // namespace
}  // namespace brainshift::geometry
