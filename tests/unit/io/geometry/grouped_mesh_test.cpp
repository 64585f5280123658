// SPDX-License-Identifier: GPL-3.0-or-later
// Names of physical groups and triangles, which brainshift solve reads besides the tetrahedra; and problem files.
#include <gmock/gmock.h>

#include "common/io/geometry/mesh_file.hpp"
#include "common/io/config/problem_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

constexpr char kGmsh2[] = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
2 5 "top lid"
3 1 "grey"
1 9 "a line"
$EndPhysicalNames
$Nodes
5
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
9 7 7 7
$EndNodes
$Elements
4
1 4 2 1 1 1 2 3 4
2 2 2 5 5 2 3 4
3 2 2 6 5 1 2 3
4 2 2 5 5 1 2 9
$EndElements
)";

constexpr char kGmsh4[] = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 5 "lid"
2 6 "both"
$EndPhysicalNames
$Entities
0 0 2 1
1 0 0 0 1 1 1 2 5 6 0
2 0 0 0 1 1 1 0 0
1 0 0 0 1 1 1 1 3 2 1 2
$EndEntities
$Nodes
1 4 1 4
3 1 0 4
1
2
3
4
0 0 0
1 0 0
0 1 0
0 0 1
$EndNodes
$Elements
3 3 1 3
2 1 2 1
1 2 3 4
2 2 2 1
2 1 2 3
3 1 4 1
3 1 2 3 4
$EndElements
)";

TEST(GroupedMesh, GmshTwoGivesNamesAndTrianglesOfKeptNodes) {
  const TemporaryFolder folder;
  const auto mesh = read_grouped_mesh(folder.write("m.msh", kGmsh2));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_THAT(mesh->surface_names, ElementsAre(Pair("top lid", 5)));
  EXPECT_THAT(mesh->volume_names, ElementsAre(Pair("grey", 1)));
  EXPECT_THAT(mesh->triangle_labels, ElementsAre(5, 6));
  EXPECT_EQ(mesh->triangles.col(0), Eigen::Vector3i(1, 2, 3));
  EXPECT_EQ(mesh->mesh.num_nodes(), 4);
}

TEST(GroupedMesh, GmshFourListsATriangleOncePerGroup) {
  const TemporaryFolder folder;
  const auto mesh = read_grouped_mesh(folder.write("m.msh", kGmsh4));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_THAT(mesh->triangle_labels, ElementsAre(5, 6));
  EXPECT_EQ(mesh->triangles.col(0), mesh->triangles.col(1));
  EXPECT_THAT(mesh->surface_names, ElementsAre(Pair("both", 6), Pair("lid", 5)));
  EXPECT_THAT(mesh->mesh.labels, ElementsAre(3));
}

TEST(GroupedMesh, ANameWithoutQuotationMarksIsRefused) {
  const TemporaryFolder folder;
  std::string text = kGmsh2;
  text.replace(text.find("\"grey\""), 6, "grey");
  const auto mesh = read_grouped_mesh(folder.write("m.msh", text));
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error().message, HasSubstr("$PhysicalNames"));
}

TEST(GroupedMesh, VtuTrianglesTakeTheirLabels) {
  const TemporaryFolder folder;
  const auto mesh = read_grouped_mesh(
      folder.write("m.vtu",
                   R"(<VTKFile type="UnstructuredGrid" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="2"><Points>
<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">1 2 3 0 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 7</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 10</DataArray></Cells>
<CellData><DataArray type="Int32" Name="label" format="ascii">8 2</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>)"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_THAT(mesh->triangle_labels, ElementsAre(8));
  EXPECT_THAT(mesh->mesh.labels, ElementsAre(2));
  EXPECT_EQ(mesh->triangles.col(0), Eigen::Vector3i(1, 2, 3));
}

TEST(ElementGrid, FieldsOfAnotherLengthAreRefusedAndGoodOnesWritten) {
  const TemporaryFolder folder;
  ElementGrid grid;
  grid.nodes = Points::Random(3, 10);
  grid.elements = Eigen::VectorXi::LinSpaced(10, 0, 9);
  const NodeField node{"displacement", Eigen::MatrixXd::Ones(3, 10)};
  const NodeField cell{"stress", Eigen::MatrixXd::Ones(6, 1)};
  EXPECT_FALSE(write_vtu(folder / "u.vtu", grid, {cell}, {}));
  EXPECT_FALSE(write_vtu(folder / "u.vtu", grid, {node}, {node}));
  EXPECT_EQ(folder.entries(), 0U);
  ASSERT_TRUE(write_vtu(folder / "u.vtu", grid, {node}, {cell}));
  const std::string text = test_support::content_of(folder / "u.vtu");
  EXPECT_THAT(text, HasSubstr("NumberOfPoints=\"10\" NumberOfCells=\"1\""));
  EXPECT_LT(text.find("displacement"), text.find("<CellData>"));
  EXPECT_GT(text.find("stress"), text.find("<CellData>"));
  // Its cell is no linear tetrahedron.
  EXPECT_FALSE(read_vtu(folder / "u.vtu"));
}

TEST(ProblemFile, EveryKeyIsRead) {
  const auto problem = parse_problem(R"(
mesh: {file: m.msh, element: p1}
groups:
  a: {plane: {point_mm: [1, 2, 3], normal: [0, 0, 1], tolerance_mm: 0.5}}
  b: {box: {min_mm: [0, 0, 0], max_mm: [1, 1, 1]}}
  c: {sphere: {centre_mm: [0, 0, 0], radius_mm: 4, tolerance_mm: 0.1}}
materials:
  m: {shear_modulus_pa: 1000, poisson_ratio: 0.4, density_kg_m3: 7, biot_coefficient: 0.9, storage_per_pa: 1e-6, permeability_m3_s_kg: 1e-7}
regions: {white: m, all: m}
body: {gravity_m_s2: [0, 0, -9.8], force_n_m3: [1, 0, 0]}
conditions:
  u: {on: a, displacement_mm: [1, 2, 3]}
  v: {on: a, displacement_y_mm: 4}
  n: {on: a, normal_displacement_mm: 0}
  t: {on: b, traction_pa: [1, 2, 3]}
  p: {on: b, pressure_pa: 5}
  q: {on: b, pore_pressure_pa: 0}
contact:
  f: {on: c, plane: {point_mm: [0, 0, -1], normal: [0, 0, 2]}, penalty_pa_per_mm: 3}
  s: {on: c, surface: floor.stl}
time: {steps_s: [1, 2]}
probes: {tip: [1, 2, 3]}
)",
                                     "/data/p.yaml");
  ASSERT_TRUE(problem) << problem.error().message;
  EXPECT_EQ(problem->mesh, "/data/m.msh");
  EXPECT_EQ(problem->element, "p1");
  EXPECT_EQ(std::get<SphereSelector>(problem->groups[2].where).radius_mm, 4.0);
  EXPECT_EQ(problem->materials[0].permeability_m3_s_kg, 1e-7);
  EXPECT_THAT(problem->regions, ElementsAre(Pair("white", "m"), Pair("all", "m")));
  EXPECT_EQ(problem->body_force_n_m3, Vec3(1, 0, 0));
  ASSERT_EQ(problem->conditions.size(), 6U);
  EXPECT_EQ(problem->conditions[0].displacement_mm[2], 3.0);
  EXPECT_FALSE(problem->conditions[1].displacement_mm[0]);
  EXPECT_EQ(problem->conditions[3].traction_pa, Vec3(1, 2, 3));
  EXPECT_EQ(problem->conditions[5].pore_pressure_pa, 0.0);
  EXPECT_EQ(problem->contact[0].penalty_pa_per_mm, 3.0);
  EXPECT_EQ(std::get<SurfaceObstacleSpec>(problem->contact[1].obstacle).file, "/data/floor.stl");
  EXPECT_THAT(problem->time->steps_s, ElementsAre(1.0, 2.0));
  EXPECT_EQ(problem->probes[0].at_mm, Vec3(1, 2, 3));
}

}  // namespace
}  // namespace brainshift::io
