// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mesh_quality.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "tests/support/box_mesh.hpp"
#include "tests/support/mesh_figures.hpp"
#include "tests/support/results.hpp"

namespace brainshift::geometry {
namespace {

using test_support::mesh_quality;
using test_support::MeshQuality;

TetMesh regular_tetrahedron(double edge) {
  TetMesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes.col(0) = Vec3(1, 1, 1);
  mesh.nodes.col(1) = Vec3(-1, 1, -1);
  mesh.nodes.col(2) = Vec3(1, -1, -1);
  mesh.nodes.col(3) = Vec3(-1, -1, 1);
  mesh.nodes *= edge / std::sqrt(8.0);
  mesh.tets.resize(4, 1);
  mesh.tets.col(0) = Eigen::Vector4i(0, 1, 2, 3);
  const Vec3 a = mesh.nodes.col(1) - mesh.nodes.col(0);
  const Vec3 b = mesh.nodes.col(2) - mesh.nodes.col(0);
  const Vec3 c = mesh.nodes.col(3) - mesh.nodes.col(0);
  if (a.cross(b).dot(c) < 0) mesh.tets.col(0) = Eigen::Vector4i(0, 2, 1, 3);
  return mesh;
}

TetMesh good_mesh() { return test_support::box_mesh(Vec3(-3, 0, 2), Vec3(5, 6, 9), 3, 0.1); }

// Two tetrahedra with `shared_nodes` nodes in common.
TetMesh joined_by(int shared_nodes) {
  TetMesh mesh;
  mesh.nodes.resize(3, 8 - shared_nodes);
  mesh.nodes.leftCols(4) << 0, 0, 0, 1,  //
      0, 1, 0, 0,                        //
      0, 0, 1, 0;
  const Vec3 away[] = {{-1, -2, -1.5}, {-2.3, -1, -3}, {-1.2, -3.1, -2}, {-3, -2.2, -0.7}};
  for (int n = 4; n < mesh.num_nodes(); ++n) mesh.nodes.col(n) = away[n - 4];
  mesh.tets.resize(4, 2);
  mesh.tets.col(0) = Eigen::Vector4i(0, 3, 1, 2);
  for (int a = 0; a < 4; ++a) mesh.tets(a, 1) = a < shared_nodes ? a : a + 4 - shared_nodes;
  const auto x = [&](int a) -> Vec3 { return mesh.nodes.col(mesh.tets(a, 1)); };
  if ((x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) < 0)
    std::swap(mesh.tets(2, 1), mesh.tets(3, 1));
  return mesh;
}

void expect_refused(const TetMesh& mesh, ErrorCode code, const std::string& part) {
  EXPECT_THAT(refusal_of(check_mesh(mesh), code),
              testing::AllOf(testing::HasSubstr(part), testing::Not(testing::HasSubstr("\n"))));
}

TEST(MeshQuality, OfARegularTetrahedronIsClosedForm) {
  const MeshQuality quality = mesh_quality(regular_tetrahedron(3.0));
  const double dihedral = std::acos(1.0 / 3.0) * 180.0 / M_PI;
  EXPECT_NEAR(quality.volume_mm3, 27.0 / (6.0 * std::sqrt(2.0)), 1e-12);
  EXPECT_NEAR(quality.min_dihedral_deg, dihedral, 1e-10);
  EXPECT_NEAR(quality.max_dihedral_deg, dihedral, 1e-10);
  EXPECT_NEAR(quality.min_edge_mm, 3.0, 1e-12);
  EXPECT_NEAR(quality.mean_edge_mm, 3.0, 1e-12);
  EXPECT_NEAR(quality.max_edge_mm, 3.0, 1e-12);
}

TEST(MeshQuality, OfKuhnCubesCountsEachEdgeOnce) {
  const int n = 3;
  const MeshQuality quality =
      mesh_quality(test_support::box_mesh(Vec3::Zero(), Vec3::Constant(n), n));
  EXPECT_NEAR(quality.volume_mm3, n * n * n, 1e-12);
  EXPECT_NEAR(quality.min_dihedral_deg, 45.0, 1e-10);
  EXPECT_NEAR(quality.max_dihedral_deg, 90.0, 1e-10);
  EXPECT_NEAR(quality.min_edge_mm, 1.0, 1e-12);
  EXPECT_NEAR(quality.max_edge_mm, std::sqrt(3.0), 1e-12);
  // Edges of the grid, face diagonals, space diagonals.
  const double edges = 3.0 * n * (n + 1) * (n + 1);
  const double diagonals = 3.0 * n * n * (n + 1);
  const double space = n * n * n;
  EXPECT_NEAR(
      quality.mean_edge_mm,
      (edges + diagonals * std::sqrt(2.0) + space * std::sqrt(3.0)) / (edges + diagonals + space),
      1e-12);
}

TEST(MeshQuality, OfNoTetrahedronIsZero) { EXPECT_EQ(mesh_quality(TetMesh{}).max_edge_mm, 0.0); }

TEST(CheckMesh, AcceptsAGoodMesh) {
  const Status status = check_mesh(good_mesh());
  EXPECT_TRUE(status) << status.error().message;
}

TEST(CheckMesh, RejectsNoTetrahedron) {
  TetMesh mesh = good_mesh();
  mesh.tets.resize(4, 0);
  expect_refused(mesh, ErrorCode::kEmptySet, "no tetrahedron");
  expect_refused(TetMesh{}, ErrorCode::kEmptySet, "no tetrahedron");
}

TEST(CheckMesh, NamesTheNodeThatIsNotFinite) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TetMesh mesh = good_mesh();
    mesh.nodes(1, 17) = bad;
    expect_refused(mesh, ErrorCode::kNotFinite, "node 17");
  }
}

TEST(CheckMesh, NamesTheIndexOutOfRange) {
  for (const int bad : {-1, 64, std::numeric_limits<int>::max()}) {
    TetMesh mesh = good_mesh();
    ASSERT_EQ(mesh.num_nodes(), 64);
    mesh.tets(2, 5) = bad;
    expect_refused(mesh, ErrorCode::kInvalidArgument,
                   "tetrahedron 5: node index " + std::to_string(bad));
  }
}

TEST(CheckMesh, RejectsLabelsOfAnotherLength) {
  TetMesh mesh = good_mesh();
  mesh.labels.assign(7, 0);
  expect_refused(mesh, ErrorCode::kInvalidArgument, "7 labels");
}

TEST(CheckMesh, NamesTheInvertedTetrahedronWithItsVolume) {
  TetMesh mesh = good_mesh();
  mesh.tets.col(8).head<2>().reverseInPlace();
  expect_refused(mesh, ErrorCode::kDegenerateMesh, "tetrahedron 8 is inverted: volume -");
}

TEST(CheckMesh, NamesTheFlatTetrahedron) {
  TetMesh mesh = regular_tetrahedron(2.0);
  mesh.nodes.col(3) = (mesh.nodes.col(0) + mesh.nodes.col(1) + mesh.nodes.col(2)) / 3.0;
  expect_refused(mesh, ErrorCode::kDegenerateMesh, "tetrahedron 0 is flat");
  mesh.nodes.setZero();
  expect_refused(mesh, ErrorCode::kDegenerateMesh, "tetrahedron 0 is flat");
}

TEST(CheckMesh, FlatIsRelativeToTheLongestEdge) {
  for (const double scale : {1e-3, 1.0, 1e3}) {
    TetMesh mesh = regular_tetrahedron(1.0);
    EXPECT_TRUE(check_mesh(mesh));
    const Vec3 base = (mesh.nodes.col(0) + mesh.nodes.col(1) + mesh.nodes.col(2)) / 3.0;
    const Vec3 apex = mesh.nodes.col(3);
    // Volume is area x height / 3 = 0.1443 x height, to be compared with 1e-9.
    const Vec3 up = (apex - base).normalized();
    mesh.nodes.col(3) = base + 1e-8 * up;
    mesh.nodes *= scale;
    EXPECT_TRUE(check_mesh(mesh)) << scale;
    mesh.nodes.col(3) = scale * (base + 5e-9 * up);
    expect_refused(mesh, ErrorCode::kDegenerateMesh, "flat");
  }
}

TEST(CheckMesh, CountsUnusedNodes) {
  TetMesh mesh = good_mesh();
  mesh.nodes.conservativeResize(3, mesh.num_nodes() + 2);
  mesh.nodes.rightCols(2).setZero();
  expect_refused(mesh, ErrorCode::kDegenerateMesh, "2 unused nodes, the first is node 64");
}

TEST(CheckMesh, TissueMustNotCountTwice) {
  TetMesh twice = good_mesh();
  const int count = twice.num_tets();
  twice.tets.conservativeResize(4, count + 1);
  twice.tets.col(count) = twice.tets.col(5)(Eigen::Vector4i(1, 2, 0, 3));
  expect_refused(twice, ErrorCode::kDegenerateMesh,
                 "tetrahedra 5 and " + std::to_string(count) + " have the same four nodes");
  TetMesh overlapping = joined_by(3);
  overlapping.nodes.col(4) = overlapping.nodes.col(2) * 0.9;
  overlapping.tets.col(1) = Eigen::Vector4i(0, 3, 1, 4);
  expect_refused(overlapping, ErrorCode::kDegenerateMesh, "tetrahedra 0 and 1 overlap");
}

TEST(CheckMesh, PartsMustBeJoinedByFaces) {
  EXPECT_TRUE(check_mesh(joined_by(3)));
  for (const int nodes : {0, 1, 2})
    expect_refused(joined_by(nodes), ErrorCode::kDegenerateMesh, "2 components");
}

}  // namespace
}  // namespace brainshift::geometry
