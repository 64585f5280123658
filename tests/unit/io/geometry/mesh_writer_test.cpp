// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/mesh_writer.hpp"

#include <gmock/gmock.h>

#include "common/io/geometry/mesh_file.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::content_of;
using test_support::replaced;
using testing::HasSubstr;
using testing::IsEmpty;

TetMesh large_mesh() {
  TetMesh mesh;
  mesh.nodes.resize(3, 60000);  // 1.4 MB: more than one compressed block
  for (Eigen::Index i = 0; i < mesh.nodes.size(); ++i) {
    mesh.nodes.data()[i] = 1.0 / (1.0 + static_cast<double>(i));
  }
  mesh.tets.resize(4, 50000);
  for (int t = 0; t < 50000; ++t) mesh.tets.col(t) << t, t + 1, t + 2, t + 10000 - 1;
  return mesh;
}

TriangleSurface sample() {
  TriangleSurface surface;
  surface.vertices.resize(3, 4);
  surface.vertices << 0, 1.0 / 3.0, 0, -1e-7, 0, 0, 2, 5, 0, 0, 0, 7;
  surface.triangles.resize(3, 2);
  surface.triangles << 0, 1, 1, 3, 2, 2;
  return surface;
}

class MeshWriter : public testing::Test {
 protected:
  test_support::TemporaryFolder folder_;
};

TEST_F(MeshWriter, WrittenMeshAndFieldsAreReadBackBitForBit) {
  TetMesh mesh = large_mesh();
  for (int t = 0; t < mesh.num_tets(); ++t) mesh.labels.push_back(t % 5 - 1);
  const NodeField displacement{"displacement <mm> & \"more\"", mesh.nodes * 2.0};
  const NodeField sd{"sd", mesh.nodes.row(1)};
  ASSERT_TRUE(write_vtu(folder_ / "m.vtu", mesh, {displacement, sd}));
  EXPECT_EQ(folder_.entries(), 1u);
  const auto read = value_or_fail(read_vtu(folder_ / "m.vtu"));
  EXPECT_EQ(read.mesh.nodes, mesh.nodes);
  EXPECT_EQ(read.mesh.tets, mesh.tets);
  EXPECT_EQ(read.mesh.labels, mesh.labels);
  ASSERT_EQ(read.node_fields.size(), 2u);
  EXPECT_EQ(read.node_fields[0].name, displacement.name);
  EXPECT_EQ(read.node_fields[0].values, displacement.values);
  EXPECT_EQ(read.node_fields[1].values, sd.values);
}

TEST_F(MeshWriter, MeshWithoutLabelsHasNoneWhenReadBack) {
  ASSERT_TRUE(write_vtu(folder_ / "m.vtu", large_mesh(), {}));
  const auto read = value_or_fail(read_vtu(folder_ / "m.vtu"));
  EXPECT_THAT(read.mesh.labels, IsEmpty());
  EXPECT_THAT(read.node_fields, IsEmpty());
}

TEST_F(MeshWriter, FieldOfAnotherLengthIsRefusedAndNothingWritten) {
  const TetMesh mesh = large_mesh();
  EXPECT_THAT(refusal_of(write_vtu(folder_ / "m.vtu", mesh, {{"u", mesh.nodes.leftCols(10)}}),
                         ErrorCode::kInvalidArgument),
              HasSubstr("field 'u' has 10 columns"));
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(MeshWriter, UnwritablePlaceIsNamed) {
  EXPECT_THAT(
      refusal_of(write_vtu(folder_ / "no" / "m.vtu", large_mesh(), {}), ErrorCode::kWriteFailed),
      HasSubstr("no/m.vtu"));
}

// 3D Slicer takes the points of a VTK file for LPS unless it finds this in the field data.
constexpr const char* kSpaceIsRas =
    "<FieldData>\n<Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">"
    "82 65 83 0</Array>\n</FieldData>\n<Piece ";

TEST_F(MeshWriter, VtkFilesSayThatTheirPointsAreRas) {
  ASSERT_TRUE(write_vtu(folder_ / "m.vtu", large_mesh(), {}));
  EXPECT_THAT(content_of(folder_ / "m.vtu"), HasSubstr(kSpaceIsRas));
  ASSERT_TRUE(write_surface(folder_ / "s.vtp", sample()));
  EXPECT_THAT(content_of(folder_ / "s.vtp"), HasSubstr(kSpaceIsRas));
}

TEST_F(MeshWriter, LpsTwinOfAWrittenMeshLoadsEqual) {
  const TetMesh mesh = large_mesh();
  TetMesh turned = mesh;
  turned.nodes.topRows<2>() *= -1.0;
  ASSERT_TRUE(write_vtu(folder_ / "ras.vtu", mesh, {{"u", mesh.nodes}}));
  ASSERT_TRUE(write_vtu(folder_ / "lps.vtu", turned, {{"u", turned.nodes}}));
  const std::string text = replaced(content_of(folder_ / "lps.vtu"), "82 65 83 0", "76 80 83 0");
  const auto ras = value_or_fail(read_vtu(folder_ / "ras.vtu"));
  const auto lps = value_or_fail(read_vtu(folder_.write("lps.vtu", text)));
  EXPECT_EQ(lps.mesh.nodes, ras.mesh.nodes);
  EXPECT_EQ(lps.node_fields[0].values, ras.node_fields[0].values);
}

TEST_F(MeshWriter, LpsTwinOfAWrittenSurfaceLoadsEqual) {
  TriangleSurface surface = sample();
  ASSERT_TRUE(write_surface(folder_ / "ras.vtp", surface));
  surface.vertices.topRows<2>() *= -1.0;
  ASSERT_TRUE(write_surface(folder_ / "lps.vtp", surface));
  const std::string text = replaced(content_of(folder_ / "lps.vtp"), "82 65 83 0", "76 80 83 0");
  const auto ras = value_or_fail(read_surface(folder_ / "ras.vtp"));
  const auto lps = value_or_fail(read_surface(folder_.write("lps.vtp", text)));
  EXPECT_EQ(lps.vertices, ras.vertices);
  EXPECT_EQ(lps.triangles, ras.triangles);
}

TEST_F(MeshWriter, WrittenSurfacesComeBackBitForBit) {
  const TriangleSurface surface = sample();
  const Eigen::MatrixXd sd = Eigen::RowVector4d(0.1, 0.2, 0.3, 0.4);
  for (const char* name : {"s.ply", "s.vtp"}) {
    const auto path = folder_ / name;
    ASSERT_TRUE(write_surface(path, surface, {{"sd_mm", sd}}));
    const auto read = value_or_fail(read_surface(path));
    EXPECT_EQ(read.vertices, surface.vertices) << name;
    EXPECT_EQ(read.triangles, surface.triangles) << name;
  }
}

TEST_F(MeshWriter, WrittenPointsComeBack) {
  TriangleSurface points = sample();
  points.triangles.resize(3, 0);
  for (const char* name : {"p.ply", "p.vtp"}) {
    const auto path = folder_ / name;
    ASSERT_TRUE(write_surface(path, points));
    const auto read = value_or_fail(read_surface_or_points(path));
    EXPECT_EQ(read.vertices, points.vertices) << name;
    EXPECT_EQ(read.num_triangles(), 0);
  }
}

TEST_F(MeshWriter, WhatCannotBeWrittenIsNamed) {
  const auto path = [&](const char* name) { return folder_ / name; };
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

TEST_F(MeshWriter, CellFieldsOfAnotherLengthAreRefusedAndGoodOnesWritten) {
  ElementGrid grid;
  grid.nodes = Points::Random(3, 10);
  grid.elements = Eigen::VectorXi::LinSpaced(10, 0, 9);
  const NodeField node{"displacement", Eigen::MatrixXd::Ones(3, 10)};
  const NodeField cell{"stress", Eigen::MatrixXd::Ones(6, 1)};
  EXPECT_FALSE(write_vtu(folder_ / "u.vtu", grid, {cell}, {}));
  EXPECT_FALSE(write_vtu(folder_ / "u.vtu", grid, {node}, {node}));
  EXPECT_EQ(folder_.entries(), 0U);
  ASSERT_TRUE(write_vtu(folder_ / "u.vtu", grid, {node}, {cell}));
  const std::string text = content_of(folder_ / "u.vtu");
  EXPECT_THAT(text, HasSubstr("NumberOfPoints=\"10\" NumberOfCells=\"1\""));
  EXPECT_LT(text.find("displacement"), text.find("<CellData>"));
  EXPECT_GT(text.find("stress"), text.find("<CellData>"));
  // Its cell is no linear tetrahedron.
  EXPECT_FALSE(read_vtu(folder_ / "u.vtu"));
}

}  // namespace
}  // namespace brainshift::io
