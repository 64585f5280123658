// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "tests/support/box_mesh.hpp"

namespace brainshift::geometry {
namespace {

using std::numbers::pi;
using test_support::box_mesh;

TetMesh one_tet() {
  TetMesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  mesh.tets.resize(4, 1);
  mesh.tets << 0, 1, 2, 3;
  return mesh;
}

double mean_edge(const TriangleSurface& surface) {
  double sum = 0.0;
  for (int t = 0; t < surface.num_triangles(); ++t)
    for (int k = 0; k < 3; ++k)
      sum += (surface.vertices.col(surface.triangles(k, t)) -
              surface.vertices.col(surface.triangles((k + 1) % 3, t)))
                 .norm();
  return sum / (3.0 * surface.num_triangles());
}

TEST(BoundaryTriangles, OfOneTetrahedronFaceOutwards) {
  const TetMesh mesh = one_tet();
  const auto triangles = boundary_triangles(mesh);
  ASSERT_EQ(triangles.cols(), 4);
  const Vec3 centre = mesh.nodes.rowwise().mean();
  for (int t = 0; t < 4; ++t) {
    const Vec3 a = mesh.nodes.col(triangles(0, t));
    const Vec3 b = mesh.nodes.col(triangles(1, t));
    const Vec3 c = mesh.nodes.col(triangles(2, t));
    EXPECT_GT((b - a).cross(c - a).dot(a - centre), 0.0);
  }
}

TEST(BoundaryTriangles, OfABoxAreItsSides) {
  const TetMesh mesh = box_mesh(Vec3(-1, 2, 0), Vec3(3, 5, 7), 4, 0.15);
  std::vector<int> tets;
  const auto triangles = boundary_triangles(mesh, &tets);
  ASSERT_EQ(triangles.cols(), 6 * 4 * 4 * 2);
  ASSERT_EQ(tets.size(), static_cast<std::size_t>(triangles.cols()));
  for (int t = 0; t < triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto nodes = mesh.tets.col(tets[static_cast<std::size_t>(t)]);
      EXPECT_TRUE((nodes.array() == triangles(k, t)).any());
    }
}

TEST(BoundaryTriangles, FollowTheirSortedNodes) {
  const auto triangles = boundary_triangles(box_mesh(Vec3::Zero(), Vec3::Ones(), 3));
  std::vector<std::array<int, 3>> keys;
  for (const auto& column : triangles.colwise()) {
    std::array<int, 3> key{column[0], column[1], column[2]};
    std::sort(key.begin(), key.end());
    keys.push_back(key);
  }
  EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
}

TEST(BoundarySurface, IsClosedAndHoldsTheMeshVolume) {
  std::vector<NodeIndex> nodes;
  const TetMesh mesh = box_mesh(Vec3(100, 200, 300), Vec3(104, 203, 307), 4, 0.15);
  const TriangleSurface surface = boundary_surface(mesh, &nodes);
  EXPECT_TRUE(is_closed(surface));
  EXPECT_NEAR(enclosed_volume(surface), 4.0 * 3.0 * 7.0, 1e-9);
  EXPECT_NEAR(area(surface), 2.0 * (12.0 + 28.0 + 21.0), 1e-9);
  ASSERT_EQ(nodes.size(), 125u - 27u);
  ASSERT_EQ(surface.num_vertices(), 98);
  EXPECT_TRUE(std::is_sorted(nodes.begin(), nodes.end()));
  for (int v = 0; v < surface.num_vertices(); ++v)
    EXPECT_EQ(surface.vertices.col(v), mesh.nodes.col(nodes[static_cast<std::size_t>(v)]));
}

TEST(BoundarySurface, OfAnEmptyMeshIsEmpty) {
  const TriangleSurface surface = boundary_surface(TetMesh{});
  EXPECT_EQ(surface.num_triangles(), 0);
  EXPECT_EQ(surface.num_vertices(), 0);
  EXPECT_FALSE(is_closed(surface));
  EXPECT_EQ(enclosed_volume(surface), 0.0);
}

TEST(VertexNormals, OfASphereAreRadial) {
  const Vec3 centre(5, -3, 40);
  const TriangleSurface sphere = ellipsoid_surface(centre, Vec3::Constant(30.0), 3.0);
  const Points normals = vertex_normals(sphere);
  for (int v = 0; v < sphere.num_vertices(); ++v) {
    EXPECT_NEAR(normals.col(v).norm(), 1.0, 1e-12);
    EXPECT_GT(normals.col(v).dot((sphere.vertices.col(v) - centre).normalized()), 0.9995);
  }
}

// Of a box of 3 x 4 x 7: thirds add up, a closed surface has no vector area, its top has its own.
TEST(VertexAreas, AddUpToTheArea) {
  const TetMesh mesh = test_support::box_mesh(3, 2, 4, Vec3(3, 4, 7));
  const TriangleSurface surface = boundary_surface(mesh);
  EXPECT_NEAR(vertex_areas(surface).sum(), area(surface), 1e-9);
  EXPECT_GT(vertex_areas(surface).minCoeff(), 0.0);
  EXPECT_LT(vector_area(surface).norm(), 1e-9);
}

TEST(SurfaceBetween, HasTheTrianglesOfItsNodesAlone) {
  const TetMesh mesh = test_support::box_mesh(3, 2, 4, Vec3(3, 4, 7));
  std::vector<NodeIndex> top;
  for (NodeIndex node = mesh.num_nodes() - 1; node >= 0; --node) {  // in falling order
    if (mesh.nodes(2, node) == 7.0) top.push_back(node);
  }
  const TriangleSurface surface = surface_between(mesh.nodes, boundary_triangles(mesh), top);
  ASSERT_EQ(surface.num_vertices(), 4 * 3);
  EXPECT_EQ(surface.num_triangles(), 2 * 3 * 2);
  EXPECT_NEAR(area(surface), 12.0, 1e-12);
  EXPECT_LT((vector_area(surface) - Vec3(0, 0, 12)).norm(), 1e-12);
  EXPECT_EQ(Vec3(surface.vertices.col(0)), Vec3(mesh.nodes.col(top.back())));
  EXPECT_EQ(surface_between(mesh.nodes, boundary_triangles(mesh), {0, 1}).num_triangles(), 0);
}

TEST(VertexNormals, AreWeightedByArea) {
  // A vertex between a triangle of area 1/2 facing +z and one of area 3/2 facing +x.
  TriangleSurface surface;
  surface.vertices.resize(3, 6);
  surface.vertices << 0, 1, 0, 0, 0, 9,  //
      0, 0, 1, 3, 0, 9,                  //
      0, 0, 0, 0, 1, 9;
  surface.triangles.resize(3, 2);
  surface.triangles.col(0) = Eigen::Vector3i(0, 1, 2);
  surface.triangles.col(1) = Eigen::Vector3i(0, 3, 4);
  const Points normals = vertex_normals(surface);
  EXPECT_LT((normals.col(0) - Vec3(3, 0, 1).normalized()).norm(), 1e-14);
  EXPECT_EQ(normals.col(5), Vec3::Zero());  // used by no triangle
}

TEST(OffsetSurface, OfASphereIsASphere) {
  const TriangleSurface sphere = ellipsoid_surface(Vec3::Zero(), Vec3::Constant(30.0), 3.0);
  const TriangleSurface skull = offset_surface(sphere, 1.0);
  EXPECT_EQ(skull.triangles, sphere.triangles);
  for (int v = 0; v < skull.num_vertices(); ++v)
    EXPECT_NEAR(skull.vertices.col(v).norm(), 31.0, 1e-3);
  EXPECT_NEAR(enclosed_volume(offset_surface(skull, -1.0)), enclosed_volume(sphere), 1.0);
}

TEST(EnclosedVolume, ChangesSignWithOrientation) {
  TriangleSurface box = boundary_surface(box_mesh(Vec3::Zero(), Vec3(1, 2, 3), 2));
  box.triangles.row(1).swap(box.triangles.row(2));
  EXPECT_NEAR(enclosed_volume(box), -6.0, 1e-12);
  EXPECT_TRUE(is_closed(box));
}

TEST(IsClosed, NoticesHolesAndTurnedTriangles) {
  const TriangleSurface box = boundary_surface(box_mesh(Vec3::Zero(), Vec3::Ones(), 2));
  TriangleSurface hole = box;
  hole.triangles.conservativeResize(3, box.num_triangles() - 1);
  EXPECT_FALSE(is_closed(hole));
  TriangleSurface turned = box;
  std::swap(turned.triangles(0, 5), turned.triangles(1, 5));
  EXPECT_FALSE(is_closed(turned));
  EXPECT_EQ(turned_edges(turned), 3);
  EXPECT_EQ(turned_edges(box), 0);
  TriangleSurface doubled = box;
  doubled.triangles.conservativeResize(3, box.num_triangles() + 1);
  doubled.triangles.col(box.num_triangles()) = box.triangles.col(0);
  EXPECT_FALSE(is_closed(doubled));
}

TEST(EllipsoidSurface, LiesOnTheEllipsoidAndIsClosed) {
  const Vec3 centre(30, -50, 10), axes(15, 12, 20);
  const TriangleSurface surface = ellipsoid_surface(centre, axes, 2.0);
  EXPECT_TRUE(is_closed(surface));
  for (int v = 0; v < surface.num_vertices(); ++v)
    EXPECT_NEAR((surface.vertices.col(v) - centre).cwiseQuotient(axes).norm(), 1.0, 1e-12);
  const double volume = 4.0 / 3.0 * pi * axes.prod();
  EXPECT_LT(enclosed_volume(surface), volume);
  EXPECT_GT(enclosed_volume(surface), 0.99 * volume);
}

TEST(EllipsoidSurface, VolumeConvergesWithSecondOrder) {
  const Vec3 axes(15, 12, 20);
  const double volume = 4.0 / 3.0 * pi * axes.prod();
  // error = C / n^2, and n^2 = (vertices - 2) / 10.
  const auto constant = [&](double edge) {
    const TriangleSurface surface = ellipsoid_surface(Vec3::Zero(), axes, edge);
    return (volume - enclosed_volume(surface)) * (surface.num_vertices() - 2);
  };
  EXPECT_NEAR(constant(3.0) / constant(1.5), 1.0, 0.02);
}

TEST(EllipsoidSurface, EdgesAreNearTheOnesAsked) {
  for (const double edge : {0.7, 1.04, 2.0, 4.0})
    for (const Vec3& axes : {Vec3(13.79, 13.79, 13.79), Vec3(18, 13, 11)})
      EXPECT_NEAR(mean_edge(ellipsoid_surface(Vec3::Zero(), axes, edge)) / edge, 1.0, 0.1);
}

TEST(EllipsoidSurface, VertexCountsAreTenSquaresPlusTwo) {
  std::set<int> counts;
  for (const double edge : {30.0, 20.0, 10.0, 7.0, 5.0, 1.04})
    counts.insert(ellipsoid_surface(Vec3::Zero(), Vec3::Constant(13.79), edge).num_vertices());
  for (const int count : counts) {
    const int n = static_cast<int>(std::lround(std::sqrt((count - 2) / 10.0)));
    EXPECT_EQ(count, 10 * n * n + 2);
  }
  EXPECT_TRUE(counts.contains(12));    // an icosahedron at the coarsest
  EXPECT_TRUE(counts.contains(2562));  // the paper's tumour has 2,541
}

TEST(SampleSurface, PointsLieOnTheSurfaceAndRepeat) {
  const TriangleSurface box = boundary_surface(box_mesh(Vec3(-1, -1, -1), Vec3::Ones(), 2));
  const Points points = sample_surface(box, 500, 3);
  for (int i = 0; i < points.cols(); ++i)
    EXPECT_NEAR(points.col(i).cwiseAbs().maxCoeff(), 1.0, 1e-12);
  EXPECT_EQ(points, sample_surface(box, 500, 3));
  EXPECT_NE(points, sample_surface(box, 500, 4));
  EXPECT_EQ(sample_surface(box, 0, 3).cols(), 0);
}

TEST(SampleSurface, IsUniformByArea) {
  // Sides of 1 x 2, 2 x 4 and 1 x 4 twice each: 2/14, 8/14 and 4/14 of the points.
  const TriangleSurface box = boundary_surface(box_mesh(Vec3::Zero(), Vec3(1, 2, 4), 1));
  const int count = 20000;
  const Points points = sample_surface(box, count, 11);
  std::map<int, int> on_axis;
  Vec3 mean = Vec3::Zero();
  for (int i = 0; i < count; ++i) {
    const Vec3 x = points.col(i);
    mean += x / count;
    for (int axis = 0; axis < 3; ++axis)
      if (x[axis] < 1e-9 || x[axis] > Vec3(1, 2, 4)[axis] - 1e-9) ++on_axis[axis];
  }
  const double fractions[] = {8.0 / 14.0, 4.0 / 14.0, 2.0 / 14.0};
  for (int axis = 0; axis < 3; ++axis) {
    const double p = fractions[axis];
    EXPECT_NEAR(on_axis[axis], p * count, 4.0 * std::sqrt(p * (1 - p) * count));  // 4 sigma
  }
  // Also within the triangles: the mean is the box's centre within 4 standard errors.
  EXPECT_LT((mean - Vec3(0.5, 1, 2)).cwiseQuotient(Vec3(0.5, 0.7, 1.4)).norm(),
            4.0 * std::sqrt(3.0 / count));
}

TEST(PlaneSection, OfASphereIsACircle) {
  const Vec3 centre(1, 2, 3), normal = Vec3(1, -2, 0.5).normalized();
  const TriangleSurface sphere = ellipsoid_surface(centre, Vec3::Constant(10.0), 0.5);
  const Points section = plane_section(sphere, normal, normal.dot(centre) + 4.0);
  const double radius = std::sqrt(100.0 - 16.0);
  double length = 0.0;
  for (int i = 0; i < section.cols(); ++i) {
    const Vec3 d = section.col(i) - (centre + 4.0 * normal);
    EXPECT_NEAR(d.dot(normal), 0.0, 1e-12);
    EXPECT_NEAR(d.norm(), radius, 0.01);  // edge^2 / (8 R) and its slope
    if (i % 2) length += (section.col(i) - section.col(i - 1)).norm();
  }
  EXPECT_NEAR(length, 2.0 * pi * radius, 0.05);
}

// Every end belongs to exactly two segments: the section is made of closed curves.
void expect_closed_curves(const Points& section) {
  std::map<std::array<double, 3>, int> uses;
  for (const auto& x : section.colwise()) ++uses[{x[0], x[1], x[2]}];
  for (const auto& [end, count] : uses) EXPECT_EQ(count, 2) << end[0] << " " << end[1];
}

TEST(PlaneSection, ClosesEvenThroughVertices) {
  const TriangleSurface sphere = ellipsoid_surface(Vec3::Zero(), Vec3(9, 7, 8), 1.0);
  expect_closed_curves(plane_section(sphere, Vec3(0, 0, 1), 0.37));
  // Through vertices and along edges of a box.
  const TriangleSurface box = boundary_surface(box_mesh(Vec3(-1, -1, -1), Vec3::Ones(), 2));
  const Points section = plane_section(box, Vec3(1, 0, 0), 0.0);
  expect_closed_curves(section);
  double length = 0.0;
  for (int i = 0; i < section.cols(); i += 2)
    length += (section.col(i) - section.col(i + 1)).norm();
  EXPECT_NEAR(length, 8.0, 1e-12);
}

TEST(PlaneSection, BesideTheSurfaceIsEmpty) {
  const TriangleSurface sphere = ellipsoid_surface(Vec3::Zero(), Vec3(9, 7, 8), 1.0);
  EXPECT_EQ(plane_section(sphere, Vec3(0, 1, 0), 7.5).cols(), 0);
  EXPECT_EQ(plane_section(TriangleSurface{}, Vec3(0, 1, 0), 0.0).cols(), 0);
}

}  // namespace
}  // namespace brainshift::geometry
