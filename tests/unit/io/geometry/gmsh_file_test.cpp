// SPDX-License-Identifier: GPL-3.0-or-later
// Gmsh files written here by hand, one after the reference manual's text, and read back.
#include <gmock/gmock.h>

#include <cstdint>
#include <sstream>

#include "common/io/geometry/mesh_file.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_refused;
using test_support::put;
using test_support::replaced;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

// Two tetrahedra on nodes 10, 20, 30, 40, 60; node 50 belongs to a triangle only. Tags are neither
// consecutive nor in order of use.
constexpr int kTags[] = {10, 20, 30, 40, 50, 60};
constexpr double kNodes[][3] = {{0, 0, 0},     {1.5, 0, 0}, {0, 2.25, 0},
                                {0, 0, -3e-3}, {9, 9, 9},   {1, 1, 1e2}};
constexpr int kTets[][4] = {{10, 20, 30, 40}, {60, 20, 30, 10}};

// Writes numbers as text or as bytes: the one difference between the two encodings.
class Numbers {
 public:
  Numbers(bool binary, bool swap) : binary_(binary), swap_(swap) {}
  template <typename T>
  Numbers& add(T value) {
    if (!binary_) {
      std::ostringstream text;
      text.precision(17);
      text << value << ' ';
      out_ += text.str();
      return *this;
    }
    std::string bytes;
    put(bytes, value);
    if (swap_) bytes.assign(bytes.rbegin(), bytes.rend());
    out_ += bytes;
    return *this;
  }
  Numbers& integer(int value) { return add<std::int32_t>(value); }
  Numbers& size(std::int64_t value) { return add<std::int64_t>(value); }
  Numbers& real(double value) { return add<double>(value); }
  Numbers& text(const std::string& value) {
    out_ += value;
    return *this;
  }
  Numbers& new_line() {
    if (!binary_) out_ += '\n';
    return *this;
  }
  bool binary() const { return binary_; }
  const std::string& str() const { return out_; }

 private:
  bool binary_;
  bool swap_;
  std::string out_;
};

void format(Numbers& out, const std::string& version) {
  out.text("$MeshFormat\n").text(version).text(out.binary() ? " 1 8\n" : " 0 8\n");
  if (out.binary()) out.integer(1).text("\n");
  out.text("$EndMeshFormat\n");
}

std::string version_2(bool binary, bool swap = false) {
  Numbers out(binary, swap);
  format(out, "2.2");
  out.text("$PhysicalNames\n1\n3 7 \"brain\"\n$EndPhysicalNames\n$Nodes\n6\n");
  for (int i = 0; i < 6; ++i) {
    out.integer(kTags[i]).real(kNodes[i][0]).real(kNodes[i][1]).real(kNodes[i][2]).new_line();
  }
  out.text("\n$EndNodes\n$Elements\n3\n");
  if (binary) out.integer(2).integer(1).integer(2);  // type, number, tags
  out.integer(1);
  if (!binary) out.integer(2).integer(2);
  out.integer(5).integer(1).integer(10).integer(20).integer(50).new_line();
  if (binary) out.integer(4).integer(2).integer(2);
  for (int t = 0; t < 2; ++t) {
    out.integer(t + 2);
    if (!binary) out.integer(4).integer(2);
    out.integer(7 + t).integer(1);
    for (const int tag : kTets[t]) out.integer(tag);
    out.new_line();
  }
  out.text("\n$EndElements\n");
  return out.str();
}

std::string version_4(bool binary, bool swap = false) {
  Numbers out(binary, swap);
  format(out, "4.1");
  // A point with a physical tag, a surface with two bounding curves, two volumes in groups 7 and
  // 8.
  out.text("$Entities\n").size(1).size(0).size(1).size(2).new_line();
  out.integer(1).real(0).real(0).real(0).size(1).integer(99).new_line();
  out.integer(1);
  for (int k = 0; k < 6; ++k) out.real(k);
  out.size(0).size(2).integer(1).integer(-2).new_line();
  for (int volume = 1; volume <= 2; ++volume) {
    out.integer(volume);
    for (int k = 0; k < 6; ++k) out.real(k);
    out.size(1).integer(6 + volume).size(1).integer(1).new_line();
  }
  out.text("\n$EndEntities\n$Nodes\n").size(2).size(6).size(10).size(60).new_line();
  // A parametric block on a surface (u, v follow x, y, z) and a plain one in a volume.
  for (int block = 0; block < 2; ++block) {
    out.integer(block + 2).integer(1).integer(block == 0 ? 1 : 0).size(3).new_line();
    for (int i = 3 * block; i < 3 * block + 3; ++i) out.size(kTags[i]).new_line();
    for (int i = 3 * block; i < 3 * block + 3; ++i) {
      for (const double x : kNodes[i]) out.real(x);
      if (block == 0) out.real(0.25).real(0.75);
      out.new_line();
    }
  }
  out.text("\n$EndNodes\n$Elements\n").size(3).size(3).size(1).size(3).new_line();
  out.integer(2).integer(1).integer(2).size(1).new_line();
  out.size(1).size(10).size(20).size(50).new_line();
  for (int t = 0; t < 2; ++t) {
    out.integer(3).integer(t + 1).integer(4).size(1).new_line();
    out.size(t + 2);
    for (const int tag : kTets[t]) out.size(tag);
    out.new_line();
  }
  out.text("\n$EndElements\n");
  return out.str();
}

struct Encoding {
  const char* name;
  std::string (*write)(bool, bool);
  bool binary;
  bool swap;
};

class GmshEncoding : public testing::TestWithParam<Encoding> {};

TEST_P(GmshEncoding, KnownMeshIsReadWithoutItsUnreferencedNode) {
  const TemporaryFolder folder;
  const Encoding& encoding = GetParam();
  const auto mesh = value_or_fail(
      read_tet_mesh(folder.write("m.msh", encoding.write(encoding.binary, encoding.swap))));
  ASSERT_EQ(mesh.num_nodes(), 5);
  ASSERT_EQ(mesh.num_tets(), 2);
  for (int t = 0; t < 2; ++t) {
    for (int k = 0; k < 4; ++k) {
      const auto* node = kNodes[kTets[t][k] / 10 - 1];
      EXPECT_EQ(mesh.nodes.col(mesh.tets(k, t)), Vec3(node[0], node[1], node[2]));
    }
  }
  EXPECT_THAT(mesh.labels, ElementsAre(7, 8));
}

// Every truncation is an error or, where only the last line's end is missing, the whole mesh.
TEST_P(GmshEncoding, NoTruncationCrashesOrGivesAPartOfTheMesh) {
  const TemporaryFolder folder;
  const Encoding& encoding = GetParam();
  const std::string whole = encoding.write(encoding.binary, encoding.swap);
  for (std::size_t size = 0; size + 1 < whole.size(); size += 17) {
    const auto mesh = read_tet_mesh(folder.write("m.msh", whole.substr(0, size)));
    EXPECT_THAT(refusal_of(mesh, ErrorCode::kUnreadable),
                testing::AllOf(HasSubstr("m.msh: "), testing::Not(testing::HasSubstr("\n"))))
        << size;
  }
}

TEST_P(GmshEncoding, FlippedBytesNeverCrash) {
  const TemporaryFolder folder;
  const Encoding& encoding = GetParam();
  const std::string whole = encoding.write(encoding.binary, encoding.swap);
  for (std::size_t at = 0; at < whole.size(); at += 19) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0xff);
    const auto mesh = read_tet_mesh(folder.write("m.msh", bytes));
    if (!mesh) continue;
    EXPECT_GE(mesh->tets.minCoeff(), 0);
    EXPECT_LT(mesh->tets.maxCoeff(), mesh->num_nodes());
  }
}

INSTANTIATE_TEST_SUITE_P(All, GmshEncoding,
                         testing::Values(Encoding{"Ascii2", version_2, false, false},
                                         Encoding{"Binary2", version_2, true, false},
                                         Encoding{"Swapped2", version_2, true, true},
                                         Encoding{"Ascii4", version_4, false, false},
                                         Encoding{"Binary4", version_4, true, false},
                                         Encoding{"Swapped4", version_4, true, true}),
                         [](const auto& param) { return param.param.name; });

class GmshFile : public testing::Test {
 protected:
  static std::string ascii(const std::string& nodes, const std::string& elements) {
    return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + nodes + "\n$EndNodes\n$Elements\n" +
           elements + "\n$EndElements\n";
  }
  static constexpr const char* kFour = "4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1";
  TemporaryFolder folder_;
};

TEST_F(GmshFile, WithoutPhysicalGroupsThereAreNoLabels) {
  const auto mesh =
      value_or_fail(read_tet_mesh(folder_.write("m.msh", ascii(kFour, "1\n1 4 2 0 1 1 2 3 4"))));
  EXPECT_THAT(mesh.labels, IsEmpty());
}

TEST_F(GmshFile, WindowsLineEndsAreRead) {
  std::string content = ascii(kFour, "1\n1 4 2 0 1 1 2 3 4");
  for (std::size_t at = 0; (at = content.find('\n', at)) != std::string::npos; at += 2)
    content.insert(at, 1, '\r');
  EXPECT_TRUE(read_tet_mesh(folder_.write("m.msh", content)));
}

TEST_F(GmshFile, BadFilesAreRefusedByWhatIsWrong) {
  const auto read = [this](const std::string& content) {
    return read_tet_mesh(folder_.write("m.msh", content));
  };
  expect_refused(
      read,
      {{ascii("8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1",
              "1\n1 5 2 0 1 1 2 3 4 5 6 7 8"),
        "m.msh: has no 4-node tetrahedron"},
       {ascii(kFour, "1\n1 4 2 0 1 1 2 3 77"), "tetrahedron 0 has node 77, which does not exist"},
       {ascii("4\n1 0 0 0\n2 1 0 0\n2 0 1 0\n4 0 0 1", "1\n1 4 2 0 1 1 2 2 4"),
        "node 2 is given twice"},
       {ascii("4\n1 nan 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1", "1\n1 4 2 0 1 1 2 3 4"), "not finite"},
       {ascii("5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1", "1\n1 4 2 0 1 1 2 3 4"), "$Nodes"},
       {ascii(kFour, "2\n1 4 2 0 1 1 2 3 4"), "$Elements"},
       {ascii(kFour, "999999999999\n1 4 2 0 1 1 2 3 4"), "promises 999999999999"},
       {ascii(kFour, "-1\n1 4 2 0 1 1 2 3 4"), "promises -1"},
       {ascii(kFour, "1\n1 77 2 0 1 1 2 3 4"), "element type 77 is unknown"},
       {"$MeshFormat\n4 0 8\n$EndMeshFormat\n", "version 4.0 is not supported"},
       {"$MeshFormat\n2.2 0 4\n$EndMeshFormat\n", "data size 4"},
       {"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "no $Nodes"},
       {"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n", "no $Elements"},
       {"", "not a Gmsh file"},
       {"<VTKFile>", "not a Gmsh file"}});
}

TEST_F(GmshFile, ElementsThatWouldGetLostAreNamedWithTheirCount) {
  const auto read = [this](const std::string& content) {
    return read_tet_mesh(folder_.write("m.msh", content));
  };
  const std::string tet = "1 4 2 0 1 1 2 3 4\n";
  expect_refused(read, {{ascii(kFour, "3\n" + tet +
                                          "2 11 2 0 1 1 2 3 4 1 2 3 4 1 2\n"
                                          "3 11 2 0 1 1 2 3 4 1 2 3 4 1 2"),
                         "has 2 10-node tetrahedra (type 11) beside 1 4-node tetrahedra"},
                        {ascii(kFour, "2\n" + tet + "2 3 2 7 1 1 2 3 4"),
                         "1 4-node quadrilaterals (type 3)"}});
  // Points, lines, and faces that belong to no group are nobody's.
  EXPECT_TRUE(read(ascii(kFour, "4\n" + tet + "2 15 2 7 1 1\n3 1 2 7 1 1 2\n4 3 2 0 1 1 2 3 4")));
}

TEST_F(GmshFile, UnknownExtensionAndMissingFileAreNamed) {
  EXPECT_THAT(refusal_of(read_tet_mesh(folder_.write("m.xyz", ""))),
              HasSubstr("unknown mesh format '.xyz'"));
  refusal_of(read_tet_mesh(folder_ / "absent.msh"), ErrorCode::kNotFound);
}

// ---- names of physical groups and triangles, which brainshift solve reads as well ----

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

// The mesh of kGmsh4 in two parts: the faces between them have their volume's group.
TEST(GroupedMesh, PartsOfEntitiesKeepTheGroupsOfTheirKind) {
  std::string parts = kGmsh4;
  const std::string end = "$EndEntities\n";
  parts.insert(parts.find(end) + end.size(),
               "$PartitionedEntities\n2\n1\n7 1\n0 0 2 1\n"
               "11 2 1 1 1 0 0 0 1 1 1 1 5 0\n"
               "12 3 1 2 1 2 0 0 0 1 1 1 1 3 0\n"
               "21 3 1 1 2 0 0 0 1 1 1 1 3 1 12\n$EndPartitionedEntities\n");
  const auto renamed = [&](const std::string& from, const std::string& to) {
    parts.replace(parts.find(from), from.size(), to);
  };
  renamed("2 1 2 1\n1 2 3 4", "2 11 2 1\n1 2 3 4");
  renamed("2 2 2 1\n2 1 2 3", "2 12 2 1\n2 1 2 3");
  renamed("3 1 4 1\n3 1 2 3 4", "3 21 4 1\n3 1 2 3 4");
  const TemporaryFolder folder;
  const auto mesh = value_or_fail(read_grouped_mesh(folder.write("m.msh", parts)));
  EXPECT_THAT(mesh.mesh.labels, ElementsAre(3));
  EXPECT_THAT(mesh.triangle_labels, ElementsAre(5));
}

TEST(GroupedMesh, ATriangleThatAGroupHasTwiceCountsOnce) {
  std::string twice = kGmsh2;
  twice.replace(twice.find("4 2 2 5 5 1 2 9"), 15, "4 2 2 5 5 3 4 2");
  const TemporaryFolder folder;
  EXPECT_THAT(value_or_fail(read_grouped_mesh(folder.write("m.msh", twice))).triangle_labels,
              ElementsAre(5, 6));
}

TEST(GroupedMesh, GmshTwoGivesNamesAndTrianglesOfKeptNodes) {
  const TemporaryFolder folder;
  const auto mesh = value_or_fail(read_grouped_mesh(folder.write("m.msh", kGmsh2)));
  EXPECT_THAT(mesh.surface_names, ElementsAre(Pair("top lid", 5)));
  EXPECT_THAT(mesh.volume_names, ElementsAre(Pair("grey", 1)));
  EXPECT_THAT(mesh.triangle_labels, ElementsAre(5, 6));
  EXPECT_EQ(mesh.triangles.col(0), Eigen::Vector3i(1, 2, 3));
  EXPECT_EQ(mesh.mesh.num_nodes(), 4);
}

TEST(GroupedMesh, GmshFourListsATriangleOncePerGroup) {
  const TemporaryFolder folder;
  const auto mesh = value_or_fail(read_grouped_mesh(folder.write("m.msh", kGmsh4)));
  EXPECT_THAT(mesh.triangle_labels, ElementsAre(5, 6));
  EXPECT_EQ(mesh.triangles.col(0), mesh.triangles.col(1));
  EXPECT_THAT(mesh.surface_names, ElementsAre(Pair("both", 6), Pair("lid", 5)));
  EXPECT_THAT(mesh.mesh.labels, ElementsAre(3));
}

TEST(GroupedMesh, ANameWithoutQuotationMarksIsRefused) {
  const TemporaryFolder folder;
  const std::string text = replaced(kGmsh2, "\"grey\"", "grey");
  EXPECT_THAT(refusal_of(read_grouped_mesh(folder.write("m.msh", text))),
              HasSubstr("$PhysicalNames"));
}

}  // namespace
}  // namespace brainshift::io
