// SPDX-License-Identifier: GPL-3.0-or-later
// Names of physical groups and triangles, which brainshift solve reads besides the tetrahedra;
// and problem files.
#include <gmock/gmock.h>

#include "common/io/geometry/mesh_file.hpp"
#include "common/io/geometry/mesh_writer.hpp"
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

}  // namespace
}  // namespace brainshift::io
