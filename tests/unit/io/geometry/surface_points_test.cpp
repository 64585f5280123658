// SPDX-License-Identifier: GPL-3.0-or-later
// Point clouds in, surfaces out.
#include <gmock/gmock.h>

#include <fstream>

#include "common/io/geometry/mesh_file.hpp"
#include "common/io/geometry/surface_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;

TriangleSurface sample() {
  TriangleSurface surface;
  surface.vertices.resize(3, 4);
  surface.vertices << 0, 1.0 / 3.0, 0, -1e-7, 0, 0, 2, 5, 0, 0, 0, 7;
  surface.triangles.resize(3, 2);
  surface.triangles << 0, 1, 1, 3, 2, 2;
  return surface;
}

class SurfacePoints : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(temporary_.path() / name) << text;
    return temporary_.path() / name;
  }
  std::string refusal(const std::string& name, const std::string& text) {
    const auto surface = read_surface_or_points(write(name, text));
    return surface ? "no refusal" : surface.error().message;
  }
  test_support::TemporaryFolder temporary_;
};

TEST_F(SurfacePoints, TextGivesPointsWithoutTriangles) {
  for (const char* name : {"p.xyz", "p.TXT", "p.csv", "p.pts"}) {
    const auto points = read_surface_or_points(
        write(name, "x y z colour\n# made by hand\n1 2 3 255\n\n-4.5,5e0;+6\r\n"));
    ASSERT_TRUE(points) << points.error().message;
    ASSERT_EQ(points->num_vertices(), 2);
    EXPECT_EQ(points->num_triangles(), 0);
    EXPECT_EQ(points->vertices.col(0), Vec3(1, 2, 3));
    EXPECT_EQ(points->vertices.col(1), Vec3(-4.5, 5, 6));
  }
}

TEST_F(SurfacePoints, APlyWithoutFacesGivesPointsHereAndIsRefusedAsASurface) {
  const auto path = write("p.ply",
                          "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
                          "property float y\nproperty float z\nend_header\n1 2 3\n4 5 6\n");
  const auto points = read_surface_or_points(path);
  ASSERT_TRUE(points) << points.error().message;
  EXPECT_EQ(points->num_vertices(), 2);
  EXPECT_EQ(points->num_triangles(), 0);
  EXPECT_THAT(read_surface(path).error().message, HasSubstr("p.ply: has no triangle"));
}

TEST_F(SurfacePoints, BadTextsAreRefused) {
  EXPECT_THAT(refusal("p.xyz", "1 2 3\n4 5\n"),
              HasSubstr("p.xyz: point 1 has 2 coordinates: must have 3"));
  EXPECT_THAT(refusal("p.xyz", "1 2 3\n4 x 6\n"), HasSubstr("line 2: \"x\" is no number"));
  EXPECT_THAT(refusal("p.xyz", "1 2 nan\n"),
              HasSubstr("node 0 has a coordinate that is not finite"));
  EXPECT_THAT(refusal("p.xyz", "nan 2 3\n"), HasSubstr("not finite"));
  EXPECT_THAT(refusal("p.xyz", ""), HasSubstr("p.xyz: has no point"));
  EXPECT_THAT(refusal("p.xyz", "x y z\n"), HasSubstr("has no point"));
  EXPECT_THAT(refusal("p.las", "1 2 3\n"), HasSubstr("unknown surface format '.las'"));
  EXPECT_THAT(read_surface(write("q.xyz", "1 2 3\n")).error().message,
              HasSubstr("unknown surface format '.xyz'"));
}

TEST_F(SurfacePoints, WrittenSurfacesComeBackBitForBit) {
  const TriangleSurface surface = sample();
  const Eigen::MatrixXd sd = Eigen::RowVector4d(0.1, 0.2, 0.3, 0.4);
  for (const char* name : {"s.ply", "s.vtp"}) {
    const auto path = temporary_.path() / name;
    ASSERT_TRUE(write_surface(path, surface, {{"sd_mm", sd}}));
    const auto read = read_surface(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->vertices, surface.vertices) << name;
    EXPECT_EQ(read->triangles, surface.triangles) << name;
  }
}

TEST_F(SurfacePoints, WrittenPointsComeBack) {
  TriangleSurface points = sample();
  points.triangles.resize(3, 0);
  for (const char* name : {"p.ply", "p.vtp"}) {
    const auto path = temporary_.path() / name;
    ASSERT_TRUE(write_surface(path, points));
    const auto read = read_surface_or_points(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->vertices, points.vertices) << name;
    EXPECT_EQ(read->num_triangles(), 0);
  }
}

TEST_F(SurfacePoints, WhatCannotBeWrittenIsNamed) {
  const auto path = [&](const char* name) { return temporary_.path() / name; };
  EXPECT_THAT(write_surface(path("s.stl"), sample()).error().message,
              HasSubstr("s.stl: unknown surface format '.stl' to write"));
  const Eigen::MatrixXd three = Eigen::MatrixXd::Zero(1, 3);
  EXPECT_THAT(write_surface(path("s.vtp"), sample(), {{"sd_mm", three}}).error().message,
              HasSubstr("field 'sd_mm' has 3 columns: must have one per vertex, 4"));
  const Eigen::MatrixXd normals = Eigen::MatrixXd::Zero(3, 4);
  EXPECT_THAT(write_surface(path("s.ply"), sample(), {{"normal", normals}}).error().message,
              HasSubstr("field 'normal': a PLY file takes one number per vertex"));
  EXPECT_TRUE(write_surface(path("s.vtp"), sample(), {{"normal", normals}}));
}

}  // namespace
}  // namespace brainshift::io
