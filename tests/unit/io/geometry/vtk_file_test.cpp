// SPDX-License-Identifier: GPL-3.0-or-later
// .vtu and .vtp in every encoding, put together here by hand; base64 has its own encoder (zlib's
// is the library's), so that an error in the reader's codec cannot cancel out.
#include <gmock/gmock.h>
#include <zlib.h>

#include <cstdint>
#include <functional>
#include <sstream>

#include "common/io/geometry/mesh_file.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::put;
using test_support::replaced;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::string base64(const std::string& bytes) {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bits;
  for (const unsigned char c : bytes) {
    for (int b = 7; b >= 0; --b) bits += (c >> b & 1) != 0 ? '1' : '0';
  }
  while (bits.size() % 6 != 0) bits += '0';
  std::string out;
  for (std::size_t i = 0; i < bits.size(); i += 6) {
    out += alphabet[std::stoul(bits.substr(i, 6), nullptr, 2)];
  }
  while (out.size() % 4 != 0) out += '=';
  return out;
}

std::string deflated(const std::string& bytes) {
  uLongf length = compressBound(bytes.size());
  std::string out(length, '\0');
  compress(reinterpret_cast<Bytef*>(out.data()), &length,
           reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  out.resize(length);
  return out;
}

struct VtkEncoding {
  const char* name;
  bool ascii = false;
  bool appended = false;
  bool raw = false;  // appended only
  bool compressed = false;
  bool wide = false;       // UInt64 headers
  bool joined = false;     // header and data in one base64 stream
  std::size_t block = 16;  // bytes per compressed block
};

// Collects a file's arrays in one encoding.
class Writer {
 public:
  explicit Writer(const VtkEncoding& encoding) : encoding_(encoding) {}

  template <typename T>
  std::string array(const std::string& name, const std::string& type, const std::vector<T>& values,
                    int components = 1) {
    std::ostringstream xml;
    xml << "<DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\""
        << components << "\" ";
    if (encoding_.ascii) {
      xml.precision(17);
      xml << "format=\"ascii\">\n";
      for (const T value : values) xml << +value << "\n ";
      xml << "</DataArray>\n";
      return xml.str();
    }
    const std::string bytes(reinterpret_cast<const char*>(values.data()),
                            values.size() * sizeof(T));
    if (!encoding_.appended) {
      xml << "format=\"binary\">\n  " << block(bytes) << "\n</DataArray>\n";
      return xml.str();
    }
    xml << "format=\"appended\" offset=\"" << appended_.size() << "\"/>\n";
    appended_ += block(bytes);
    return xml.str();
  }

  std::string file(const std::string& grid, const std::string& piece) const {
    std::string xml = "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + grid +
                      "\" version=\"1.0\" byte_order=\"LittleEndian\"";
    if (encoding_.wide) xml += " header_type=\"UInt64\"";
    if (encoding_.compressed) xml += " compressor=\"vtkZLibDataCompressor\"";
    xml += ">\n<" + grid + ">\n" + piece + "</" + grid + ">\n";
    if (encoding_.appended) {
      xml += std::string("<AppendedData encoding=\"") + (encoding_.raw ? "raw" : "base64") +
             "\">\n _" + appended_ + "\n</AppendedData>\n";
    }
    return xml + "</VTKFile>\n";
  }

 private:
  void number(std::string& out, std::size_t value) const {
    if (encoding_.wide) {
      put<std::uint64_t>(out, value);
    } else {
      put<std::uint32_t>(out, static_cast<std::uint32_t>(value));
    }
  }
  std::string block(const std::string& bytes) const {
    std::string header;
    std::string data = bytes;
    if (encoding_.compressed) {
      data.clear();
      std::string sizes;
      std::size_t blocks = 0;
      for (std::size_t at = 0; at < bytes.size(); at += encoding_.block, ++blocks) {
        const std::string part = deflated(bytes.substr(at, encoding_.block));
        number(sizes, part.size());
        data += part;
      }
      number(header, blocks);
      number(header, encoding_.block);
      number(header, bytes.size() % encoding_.block);
      header += sizes;
    } else {
      number(header, bytes.size());
    }
    if (encoding_.raw) return header + data;
    return encoding_.joined ? base64(header + data) : base64(header) + base64(data);
  }
  VtkEncoding encoding_;
  std::string appended_;
};

// A tetrahedron, a triangle that is to be ignored, another tetrahedron; point 4 belongs to the
// triangle.
const std::vector<double> kPoints = {0, 0, 0,     1.5, 0, 0, 0, 2.25, 0,
                                     0, 0, -3e-3, 9,   9, 9, 1, 1,    1e2};
const std::vector<std::int64_t> kConnectivity = {0, 1, 2, 3, 0, 1, 4, 5, 1, 2, 0};
const std::vector<std::int64_t> kOffsets = {4, 7, 11};
const std::vector<std::uint8_t> kTypes = {10, 5, 10};

// SPACE as VTK's own writer puts it into the field data: a text is its characters and a 0.
std::string vtk_text(Writer& out, const std::string& text) {
  std::string array =
      out.array("SPACE", "Int8", std::vector<std::int8_t>(text.begin(), text.end()));
  array = replaced(array, "Int8", "String");
  for (std::size_t at = 0; (at = array.find("DataArray", at)) != std::string::npos;) {
    array.replace(at, 9, "Array");
  }
  return "<FieldData>\n" + array + "</FieldData>\n";
}

// Files of other programs and of earlier versions of this one have no SPACE.
std::string vtu(const VtkEncoding& encoding, const std::string& space = {}) {
  Writer out(encoding);
  std::string piece = space.empty() ? "" : vtk_text(out, space + std::string(1, '\0'));
  piece += "<Piece NumberOfPoints=\"6\" NumberOfCells=\"3\">\n<PointData>\n";
  piece += out.array("id", "Int32", std::vector<std::int32_t>{0, 1, 2, 3, 4, 5});
  piece += out.array("u", "Float64", kPoints, 3);
  piece += out.array("p", "Float32", std::vector<float>{1, 2, 3, 4, 5, 6.5f});
  piece += "</PointData>\n<CellData>\n" +
           out.array("label", "Int32", std::vector<std::int32_t>{3, 99, -4}) +
           "</CellData>\n<Points>\n" + out.array("Points", "Float64", kPoints, 3) +
           "</Points>\n<Cells>\n" + out.array("connectivity", "Int64", kConnectivity) +
           out.array("offsets", "Int64", kOffsets) + out.array("types", "UInt8", kTypes) +
           "</Cells>\n</Piece>\n";
  return out.file("UnstructuredGrid", piece);
}

class VtuEncoding : public testing::TestWithParam<VtkEncoding> {
 protected:
  TemporaryFolder folder_;
};

TEST_P(VtuEncoding, KnownMeshIsReadWithItsFields) {
  const auto read = value_or_fail(read_vtu(folder_.write("m.vtu", vtu(GetParam()))));
  ASSERT_EQ(read.mesh.num_nodes(), 6) << "read_vtu keeps every point";
  EXPECT_EQ(read.mesh.nodes, Eigen::Map<const Points>(kPoints.data(), 3, 6));
  ASSERT_EQ(read.mesh.num_tets(), 2);
  EXPECT_EQ(read.mesh.tets.col(0), Eigen::Vector4i(0, 1, 2, 3));
  EXPECT_EQ(read.mesh.tets.col(1), Eigen::Vector4i(5, 1, 2, 0));
  EXPECT_THAT(read.mesh.labels, ElementsAre(3, -4));
  ASSERT_EQ(read.node_fields.size(), 2u) << "integer arrays are no fields";
  EXPECT_EQ(read.node_fields[0].name, "u");
  EXPECT_EQ(read.node_fields[0].values, Eigen::Map<const Eigen::MatrixXd>(kPoints.data(), 3, 6));
  EXPECT_EQ(read.node_fields[1].name, "p");
  EXPECT_EQ(read.node_fields[1].values.rows(), 1);
  EXPECT_EQ(read.node_fields[1].values(0, 5), 6.5);
}

TEST_P(VtuEncoding, TetMeshDropsTheUnreferencedNode) {
  const auto mesh = value_or_fail(read_tet_mesh(folder_.write("m.vtu", vtu(GetParam()))));
  ASSERT_EQ(mesh.num_nodes(), 5);
  EXPECT_EQ(mesh.nodes.col(mesh.tets(0, 1)), Vec3(1, 1, 100));
}

TEST_P(VtuEncoding, NoTruncationCrashesOrGivesAPartOfTheMesh) {
  const std::string whole = vtu(GetParam());
  for (std::size_t size = 0; size + 1 < whole.size(); size += 101) {
    const auto read = read_vtu(folder_.write("m.vtu", whole.substr(0, size)));
    if (read) {
      // What follows the last array of an appended file may be missing.
      EXPECT_TRUE(GetParam().appended);
      EXPECT_EQ(read->mesh.num_tets(), 2);
      EXPECT_EQ(read->mesh.nodes, Eigen::Map<const Points>(kPoints.data(), 3, 6));
      continue;
    }
    EXPECT_THAT(read.error().message, HasSubstr("m.vtu: "));
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
}

TEST_P(VtuEncoding, FlippedBytesNeverCrash) {
  const std::string whole = vtu(GetParam());
  for (std::size_t at = 0; at < whole.size(); at += 67) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x55);
    const auto read = read_vtu(folder_.write("m.vtu", bytes));
    if (!read) continue;
    EXPECT_GE(read->mesh.tets.minCoeff(), 0);
    EXPECT_LT(read->mesh.tets.maxCoeff(), read->mesh.num_nodes());
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, VtuEncoding,
    testing::Values(VtkEncoding{.name = "Ascii", .ascii = true}, VtkEncoding{.name = "Base64"},
                    VtkEncoding{.name = "Base64Wide", .wide = true},
                    VtkEncoding{.name = "Base64Joined", .joined = true},
                    VtkEncoding{.name = "Zlib", .compressed = true},
                    VtkEncoding{.name = "ZlibWide", .compressed = true, .wide = true},
                    VtkEncoding{.name = "ZlibOneBlock", .compressed = true, .block = 4096},
                    VtkEncoding{.name = "ZlibFullBlocks", .compressed = true, .block = 1},
                    VtkEncoding{.name = "AppendedRaw", .appended = true, .raw = true},
                    VtkEncoding{.name = "AppendedRawZlib",
                                .appended = true,
                                .raw = true,
                                .compressed = true,
                                .wide = true},
                    VtkEncoding{.name = "AppendedBase64", .appended = true},
                    VtkEncoding{
                        .name = "AppendedBase64Zlib", .appended = true, .compressed = true}),
    [](const auto& param) { return param.param.name; });

class VtuFile : public testing::Test {
 protected:
  // The ascii file with one piece of text replaced.
  void expect_refusals(std::initializer_list<test_support::BadEdit> cases) {
    const auto read = [this](const std::string& text) {
      auto mesh = read_tet_mesh(folder_.write("m.vtu", text));
      if (!mesh) {
        EXPECT_THAT(mesh.error().message, HasSubstr("m.vtu: "));
      }
      return mesh;
    };
    expect_edits_refused(read, vtu(VtkEncoding{.name = "", .ascii = true}), cases);
  }
  TemporaryFolder folder_;
};

TEST_F(VtuFile, IndexOutOfRangeIsNamed) {
  expect_refusals({{"0\n 1\n 2\n 3\n 0\n 1\n 4\n", "0\n 1\n 2\n 6\n 0\n 1\n 4\n",
                    "tetrahedron 0 has node index 6: must be between 0 and 5"},
                   {"0\n 1\n 2\n 3\n 0\n 1\n 4\n", "0\n 1\n 2\n -1\n 0\n 1\n 4\n",
                    "tetrahedron 0 has node index -1"},
                   {"0\n 1\n 2\n 3\n 0\n 1\n 4\n", "0\n 1\n 2\n 4294967296\n 0\n 1\n 4\n",
                    "tetrahedron 0 has node index -1"}});
}

TEST_F(VtuFile, WrongCountsAreNamed) {
  expect_refusals({{"NumberOfPoints=\"6\"", "NumberOfPoints=\"7\"",
                    "Points array 'Points' has 18 numbers: must have 7 x 3"},
                   {"NumberOfPoints=\"6\"", "NumberOfPoints=\"-6\"", "must be a count"},
                   {"NumberOfCells=\"3\"", "NumberOfCells=\"2\"", "'offsets' has 3 numbers"},
                   {"10\n 5\n 10\n", "10\n 5\n", "'types' has 2 numbers"},
                   {"4\n 7\n 11\n", "3\n 7\n 11\n", "tetrahedron with 3 vertices"},
                   {"4\n 7\n 11\n", "4\n 7\n 12\n", "offset 2 is 12"},
                   {"4\n 7\n 11\n", "4\n 3\n 11\n", "offset 1 is 3"},
                   {"3\n 99\n -4\n", "3\n 99\n", "'label' has 2 numbers"}});
}

TEST_F(VtuFile, MissingOrUnknownPartsAreNamed) {
  expect_refusals(
      {{"Name=\"types\"", "Name=\"kinds\"", "no array 'types'"},
       {"type=\"Float64\" Name=\"Points\"", "type=\"Float16\" Name=\"Points\"",
        "unknown type 'Float16'"},
       {"type=\"Float64\" Name=\"Points\"", "type=\"Int64\" Name=\"Points\"", "Points"},
       {"VTKFile type=\"UnstructuredGrid\"", "VTKFile type=\"ImageData\"",
        "holds 'ImageData': must be 'UnstructuredGrid'"},
       {" byte_order", " compressor=\"vtkLZ4DataCompressor\" byte_order", "vtkLZ4DataCompressor"},
       {"</Piece>", "</Piece><Piece/>", "several pieces"},
       {"0\n 1\n 2\n 3\n 0\n 1\n 4\n", "0\n 1,5\n 2\n 3\n 0\n 1\n 4\n", "not a number"},
       {"<VTKFile", "<Other", "is not well-formed XML"},
       // Hexahedra alone.
       {"10\n 5\n 10\n", "12\n 5\n 12\n", "has no 4-node tetrahedron, but"}});
}

TEST_P(VtuEncoding, PointsAndVectorsInLpsAreTurnedIntoRas) {
  const Eigen::Map<const Points> as_written(kPoints.data(), 3, 6);
  const Eigen::DiagonalMatrix<double, 3> turn(-1.0, -1.0, 1.0);
  const auto ras = value_or_fail(read_vtu(folder_.write("r.vtu", vtu(GetParam(), "RAS"))));
  EXPECT_EQ(ras.mesh.nodes, as_written);
  EXPECT_EQ(ras.node_fields[0].values, as_written);
  const auto lps = value_or_fail(read_vtu(folder_.write("l.vtu", vtu(GetParam(), "LPS"))));
  EXPECT_EQ(lps.mesh.nodes, Points(turn * as_written));
  EXPECT_EQ(lps.mesh.tets, ras.mesh.tets);
  EXPECT_EQ(lps.node_fields[0].values, Points(turn * as_written));
  EXPECT_EQ(lps.node_fields[1].values, ras.node_fields[1].values) << "scalars have no frame";
  const auto grouped = value_or_fail(read_tet_mesh(folder_ / "l.vtu"));
  EXPECT_EQ(grouped.nodes.col(1), Vec3(-1.5, 0, 0));
}

TEST_P(VtuEncoding, AnotherSpaceIsRefusedByFileAndValue) {
  EXPECT_THAT(refusal_of(read_vtu(folder_.write("m.vtu", vtu(GetParam(), "LAS")))),
              HasSubstr("m.vtu: SPACE is 'LAS': must be RAS or LPS"));
}

TEST_F(VtuFile, MalformedSpaceIsNamed) {
  const VtkEncoding ascii{.name = "", .ascii = true};
  const std::string whole = vtu(ascii, "RAS");
  const std::string codes = "82\n 65\n 83\n 0\n";
  const auto read = [this](const std::string& text) {
    return read_vtu(folder_.write("m.vtu", text));
  };
  expect_edits_refused(read, whole,
                       {{codes, "", "m.vtu: SPACE is '': must be RAS or LPS"},
                        {codes, "RAS", "'SPACE' holds something that is not the code"},
                        {codes, "82 65 400", "'SPACE' holds a code that is no character"},
                        {codes, "82 65 83 0 76 80 83 0", "several texts: must be one"},
                        {"type=\"String\"", "type=\"Int8\"", "must be String"},
                        // One printable line.
                        {codes, "27 10 200 0", "SPACE is '" + std::string(3, '?') + "'"}});
  EXPECT_TRUE(read(replaced(whole, codes, "82 65 83"))) << "the ending 0 may be missing";
}

std::string vtp(const VtkEncoding& encoding, const std::vector<std::int32_t>& offsets,
                const std::string& attributes) {
  Writer out(encoding);
  std::string piece = "<Piece NumberOfPoints=\"4\" " + attributes + ">\n<Points>\n";
  piece +=
      out.array("Points", "Float32", std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 3);
  piece += "</Points>\n<Polys>\n" +
           out.array("connectivity", "Int32", std::vector<std::int32_t>{0, 2, 1, 0, 1, 3}) +
           out.array("offsets", "Int32", offsets) + "</Polys>\n</Piece>\n";
  return out.file("PolyData", piece);
}

TEST(VtpFile, TrianglesAreReadInEveryEncoding) {
  const TemporaryFolder folder;
  for (const VtkEncoding& encoding :
       {VtkEncoding{.name = "", .ascii = true}, VtkEncoding{.name = "", .compressed = true},
        VtkEncoding{.name = "", .appended = true, .raw = true}}) {
    const auto surface = value_or_fail(
        read_surface(folder.write("s.vtp", vtp(encoding, {3, 6}, "NumberOfPolys=\"2\""))));
    EXPECT_EQ(surface.num_vertices(), 4);
    EXPECT_EQ(surface.vertices.col(3), Vec3(0, 0, 1));
    EXPECT_EQ(surface.triangles.col(0), Eigen::Vector3i(0, 2, 1));
    EXPECT_EQ(surface.triangles.col(1), Eigen::Vector3i(0, 1, 3));
  }
}

TEST(VtpFile, PolygonsAndStripsAreRefused) {
  const TemporaryFolder folder;
  const VtkEncoding ascii{.name = "", .ascii = true};
  const auto read = [&](const std::string& text) {
    return read_surface(folder.write("s.vtp", text));
  };
  expect_refused(
      read,
      {{vtp(ascii, {4, 6}, "NumberOfPolys=\"2\""), "s.vtp: polygon 0 has 4 vertices: must have 3"},
       {vtp(ascii, {3, 6}, "NumberOfPolys=\"2\" NumberOfStrips=\"1\""), "triangle strips"}});
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

}  // namespace
}  // namespace brainshift::io
