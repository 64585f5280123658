// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces in .stl, .ply and .obj and points as text; .vtp is in vtk_file_test.cpp.
#include <gmock/gmock.h>

#include <cctype>
#include <cstdint>
#include <limits>
#include <sstream>

#include "common/io/geometry/mesh_file.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::put;
using test_support::TemporaryFolder;
using testing::HasSubstr;

// A tetrahedron's surface, outward.
constexpr float kVertices[4][3] = {{0, 0, 0}, {10.5f, 0, 0}, {0, -7.25f, 0}, {0, 0, 3e-2f}};
constexpr int kTriangles[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}};

std::string stl_ascii() {
  std::ostringstream out;
  out << "solid test\n";
  for (const auto& triangle : kTriangles) {
    out << "  facet normal 0 0 0\n    outer loop\n";
    for (const int v : triangle) {
      out << "      vertex " << kVertices[v][0] << ' ' << kVertices[v][1] << ' ' << kVertices[v][2]
          << '\n';
    }
    out << "    endloop\n  endfacet\n";
  }
  out << "endsolid test\n";
  return out.str();
}

// Begins with "solid", as some programs' binary files do.
std::string stl_binary() {
  std::string out = "solid but binary";
  out.resize(80, ' ');
  put<std::uint32_t>(out, 4);
  for (const auto& triangle : kTriangles) {
    for (int k = 0; k < 3; ++k) put<float>(out, 0);
    for (const int v : triangle) {
      for (const float x : kVertices[v]) put<float>(out, x);
    }
    put<std::uint16_t>(out, 0);
  }
  return out;
}

constexpr const char* kPlyHeader =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
    "quality\n"
    "element edge 1\nproperty int a\nproperty int b\n"
    "element face 4\nproperty list uchar int vertex_indices\nproperty short flag\nend_header\n";

std::string ply_ascii() {
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\ncomment made by hand\n" << kPlyHeader;
  for (const auto& v : kVertices) out << v[0] << ' ' << v[1] << ' ' << v[2] << " 7\n";
  out << "0 1\n";
  for (const auto& t : kTriangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << " -1\n";
  return out.str();
}

std::string ply_binary() {
  std::string out = std::string("ply\nformat binary_little_endian 1.0\n") + kPlyHeader;
  for (const auto& v : kVertices) {
    for (const float x : v) put<float>(out, x);
    put<std::uint8_t>(out, 7);
  }
  put<std::int32_t>(out, 0);
  put<std::int32_t>(out, 1);
  for (const auto& t : kTriangles) {
    put<std::uint8_t>(out, 3);
    for (const int v : t) put<std::int32_t>(out, v);
    put<std::int16_t>(out, -1);
  }
  return out;
}

std::string obj(bool from_end) {
  std::ostringstream out;
  out << "# made by hand\no head\n";
  for (const auto& v : kVertices) out << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  out << "vn 0 0 1\ns off\n";
  for (const auto& t : kTriangles) {
    out << 'f';
    for (const int v : t) out << ' ' << (from_end ? v - 4 : v + 1) << "//1";
    out << '\n';
  }
  return out.str();
}

struct Format {
  const char* name;
  const char* file;
  std::string content;
};

class SurfaceFormat : public testing::TestWithParam<Format> {
 protected:
  TemporaryFolder folder_;
};

TEST_P(SurfaceFormat, KnownSurfaceIsReadWithSharedVertices) {
  const auto surface =
      value_or_fail(read_surface(folder_.write(GetParam().file, GetParam().content)));
  ASSERT_EQ(surface.num_vertices(), 4);
  ASSERT_EQ(surface.num_triangles(), 4);
  for (int t = 0; t < 4; ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto& v = kVertices[kTriangles[t][k]];
      EXPECT_LT((surface.vertices.col(surface.triangles(k, t)) - Vec3(v[0], v[1], v[2])).norm(),
                1e-6);
    }
  }
}

TEST_P(SurfaceFormat, NoTruncationCrashes) {
  const std::string& whole = GetParam().content;
  for (std::size_t size = 0; size < whole.size(); size += 23) {
    const auto surface = read_surface(folder_.write(GetParam().file, whole.substr(0, size)));
    if (!surface) {
      EXPECT_EQ(surface.error().code, ErrorCode::kUnreadable);
      EXPECT_THAT(surface.error().message, HasSubstr(GetParam().file));
      continue;
    }
    EXPECT_GE(surface->triangles.minCoeff(), 0);
    EXPECT_LT(surface->triangles.maxCoeff(), surface->num_vertices());
  }
}

TEST_P(SurfaceFormat, FlippedBytesNeverCrash) {
  for (std::size_t at = 0; at < GetParam().content.size(); at += 13) {
    std::string bytes = GetParam().content;
    bytes[at] = static_cast<char>(bytes[at] ^ 0xff);
    const auto surface = read_surface(folder_.write(GetParam().file, bytes));
    if (!surface) continue;
    EXPECT_GE(surface->triangles.minCoeff(), 0);
    EXPECT_LT(surface->triangles.maxCoeff(), surface->num_vertices());
    EXPECT_TRUE(surface->vertices.allFinite());
  }
}

INSTANTIATE_TEST_SUITE_P(All, SurfaceFormat,
                         testing::Values(Format{"StlAscii", "s.stl", stl_ascii()},
                                         Format{"StlBinary", "s.STL", stl_binary()},
                                         Format{"PlyAscii", "s.ply", ply_ascii()},
                                         Format{"PlyBinary", "s.ply", ply_binary()},
                                         Format{"Obj", "s.obj", obj(false)},
                                         Format{"ObjFromEnd", "s.obj", obj(true)}),
                         [](const auto& param) { return param.param.name; });

class BadSurface : public testing::Test {
 protected:
  // read_surface of a file of this name.
  auto reading(const std::string& name) {
    return [this, name](const std::string& content) {
      return read_surface(folder_.write(name, content));
    };
  }
  TemporaryFolder folder_;
};

TEST(SurfaceFile, StlKeywordsCountInAnyCase) {
  std::string capitals = stl_ascii();
  for (char& c : capitals) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  const TemporaryFolder folder;
  const auto surface = value_or_fail(read_surface(folder.write("s.stl", capitals)));
  const auto same = value_or_fail(read_surface(folder.write("t.stl", stl_ascii())));
  EXPECT_EQ(surface.vertices, same.vertices);
  EXPECT_EQ(surface.triangles, same.triangles);
}

TEST(SurfaceFile, VerticesWithoutATriangleAreDropped) {
  const TemporaryFolder folder;
  const auto surface = value_or_fail(read_surface(
      folder.write("s.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 500 0 0\nv 0 1 0\nf 2 3 5\n")));
  ASSERT_EQ(surface.num_vertices(), 3);
  EXPECT_EQ(surface.vertices.col(2), Vec3(0, 1, 0));
  EXPECT_EQ(surface.triangles.col(0), Eigen::Vector3i(0, 1, 2));
}

TEST_F(BadSurface, StlProblemsAreNamed) {
  const auto read = reading("s.stl");
  expect_edits_refused(read, stl_ascii(),
                       {{"endsolid test", "", "before endsolid"},
                        {"      vertex 0 0 0\n", "", "s.stl: facet 0 does not have three vertices"},
                        {"10.5", "nan", "'nan' of facet 0"}});
  std::string not_finite = stl_binary();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  not_finite.replace(84 + 12, 4, reinterpret_cast<const char*>(&nan), 4);
  expect_refused(read, {{stl_binary().substr(0, 200).replace(0, 5, "other"),
                         "neither an ASCII STL nor a binary one"},
                        {not_finite, "triangle 0 has a coordinate that is not finite"}});
}

TEST_F(BadSurface, PlyProblemsAreNamed) {
  const auto read = reading("s.ply");
  expect_edits_refused(
      read, ply_ascii(),
      {{"format ascii", "format binary_big_endian", "'binary_big_endian' is not supported"},
       {"3 0 1 2", "4 0 1 2 3", "face 0 has 4 vertices: must have 3"},
       {"3 0 1 2", "3 0 1 4", "triangle 0 has node index 4: must be between 0 and 3"},
       {"element face 4", "element face 5", "ends too early"},
       {"element vertex 4", "element vertex 999999999999", "element 'vertex' ends too early"},
       {"float z", "float w", "lacks x, y or z"}});
  expect_edits_refused(read, ply_binary(),
                       {{"short flag", "strange flag", "'strange' is unknown"}});
  expect_refused(read, {{"hello", "not a PLY file"}});
}

TEST_F(BadSurface, ObjProblemsAreNamed) {
  const std::string face = "f 1//1 2//1 3//1";
  expect_edits_refused(reading("s.obj"), obj(false),
                       {{face, "f 1 2 3 4", "s.obj: line 9: face has 4 vertices: must have 3"},
                        {face, "f 1 2 5", "triangle 0 has node index 4"},
                        {face, "f 0 1 2", "vertex 0 does not exist"},
                        {face, "f -5 1 2", "vertex -5 does not exist"},
                        {face, "f a b c", "'a' is no vertex"},
                        {"v 0 0 0", "v 0 0", "line 3: vertex without three coordinates"}});
}

TEST_F(BadSurface, SurfaceWithoutTriangleIsRefused) {
  expect_refused(reading("s.obj"),
                 {{"v 0 0 0\n", "s.obj: has no triangle"}, {"", "has no triangle"}});
  expect_refused(reading("s.stl"), {{"solid s\nendsolid s\n", "has no triangle"}});
}

TEST_F(BadSurface, UnknownExtensionAndMissingFileAreNamed) {
  expect_refused(reading("s.xyz"), {{"", "unknown surface format '.xyz'"},
                                    {"1 2 3\n", "unknown surface format '.xyz'"}});
  refusal_of(read_surface(folder_ / "absent.stl"), ErrorCode::kNotFound);
}

// The text with what 3D Slicer puts into its models: a heading (STL), a comment (PLY, OBJ).
std::string with_heading(const std::string& file, std::string text, const std::string& space) {
  const std::string words = "3D Slicer output. SPACE=" + space;
  if (file == "binary.stl") return text.replace(0, words.size() + 1, words + std::string(1, '\0'));
  if (file == "ascii.stl") return text.replace(text.find(" test"), 5, " " + words);
  if (file == "s.obj") return "# wavefront obj file\n# " + words + "\n" + text;
  return text.insert(text.find("element vertex"), "comment SPACE=" + space + "\n");
}

const std::vector<std::pair<std::string, std::string>>& slicer_files() {
  static const std::vector<std::pair<std::string, std::string>> kFiles = {
      {"ascii.stl", stl_ascii()},
      {"binary.stl", stl_binary()},
      {"ascii.ply", ply_ascii()},
      {"binary.ply", ply_binary()},
      {"s.obj", obj(false)}};
  return kFiles;
}

TEST(SurfaceSpace, ModelThatSaysLpsIsTurnedIntoRas) {
  const TemporaryFolder folder;
  const Eigen::DiagonalMatrix<double, 3> turn(-1.0, -1.0, 1.0);
  for (const auto& [file, text] : slicer_files()) {
    const auto unsaid = read_surface(folder.write(file, text));
    const auto ras = read_surface(folder.write(file, with_heading(file, text, "RAS")));
    const auto lps = read_surface(folder.write(file, with_heading(file, text, "LPS")));
    ASSERT_TRUE(unsaid && ras && lps) << file;
    EXPECT_EQ(ras->vertices, unsaid->vertices) << file;
    EXPECT_EQ(lps->vertices, Points(turn * unsaid->vertices)) << file;
    EXPECT_EQ(lps->triangles, unsaid->triangles) << file;
  }
}

TEST(SurfaceSpace, AnotherSpaceIsRefusedByFileAndValue) {
  const TemporaryFolder folder;
  for (const auto& [file, text] : slicer_files()) {
    EXPECT_THAT(refusal_of(read_surface(folder.write(file, with_heading(file, text, "LAS")))),
                testing::AllOf(HasSubstr(file), HasSubstr("SPACE is 'LAS': must be RAS or LPS")));
  }
}

TEST(SurfaceSpace, WordThatOnlyEndsLikeTheKeySaysNothing) {
  const TemporaryFolder folder;
  const auto read =
      value_or_fail(read_surface(folder.write("s.obj", "# COLOURSPACE=sRGB\n" + obj(false))));
  EXPECT_EQ(read.vertices.col(1), Vec3(10.5, 0, 0));
}

// ---- points ----

class SurfacePoints : public testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(SurfacePoints, TextGivesPointsWithoutTriangles) {
  for (const char* name : {"p.xyz", "p.TXT", "p.csv", "p.pts"}) {
    const auto points = value_or_fail(read_surface_or_points(folder_.write(
        name, "x y z colour\n# made by hand\n1 2\t3 255\n// another\n\n -4.5,5e0;+6\r\n")));
    ASSERT_EQ(points.num_vertices(), 2);
    EXPECT_EQ(points.num_triangles(), 0);
    EXPECT_EQ(points.vertices.col(0), Vec3(1, 2, 3));
    EXPECT_EQ(points.vertices.col(1), Vec3(-4.5, 5, 6));
  }
}

TEST_F(SurfacePoints, AHeadingIsObeyedAndNotSkipped) {
  for (const char* text : {"l,p,s\n-1,-2,3\n4.5,-5,6\n", "//L P S\n-1 -2 3\n4.5 -5 6\n",
                           "Label;z;x;y\na;3;1;2\nb;6;-4.5;5\n",
                           "label,r,a,s,defined\n,1,2,3,1\nlost,0,0,0,0\nb,-4.5,5,6,1\n",
                           "# SPACE=LPS\n-1 -2 3\n4.5 -5 6\n"}) {
    const auto points = value_or_fail(read_surface_or_points(folder_.write("p.csv", text)));
    ASSERT_EQ(points.num_vertices(), 2) << text;
    EXPECT_EQ(points.vertices.col(0), Vec3(1, 2, 3)) << text;
    EXPECT_EQ(points.vertices.col(1), Vec3(-4.5, 5, 6)) << text;
  }
  const auto prose = value_or_fail(read_surface_or_points(
      folder_.write("p.xyz", "# traced by hand, z up, y and x as usual\n1 2 3\n")));
  EXPECT_EQ(prose.vertices.col(0), Vec3(1, 2, 3));
  const auto read = [this](const std::string& text) {
    return read_surface_or_points(folder_.write("p.csv", text));
  };
  expect_refused(read, {{"i,j,k\n1,2,3\n", "line 1: the heading \"i,j,k\" must name columns"},
                        {"x_m,y_m,z_m\n1,2,3\n", "must name columns"},
                        {"x,y,z\n1,2\n", "line 2: point 0: \"1,2\" must have three"}});
}

TEST_F(SurfacePoints, APlyWithoutFacesGivesPointsHereAndIsRefusedAsASurface) {
  const auto path = folder_.write("p.ply",
                                  "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
                                  "property float y\nproperty float z\nend_header\n1 2 3\n4 5 6\n");
  const auto points = value_or_fail(read_surface_or_points(path));
  EXPECT_EQ(points.num_vertices(), 2);
  EXPECT_EQ(points.num_triangles(), 0);
  EXPECT_THAT(read_surface(path).error().message, HasSubstr("p.ply: has no triangle"));
}

TEST_F(SurfacePoints, BadTextsAreRefused) {
  const auto read = [this](const std::string& text) {
    return read_surface_or_points(folder_.write("p.xyz", text));
  };
  expect_refused(read, {{"1 2 3\n4 5\n", "p.xyz: line 2: point 1 has 2 coordinates: must have 3"},
                        {"1 2 3\n# ok\n4 5x 6\n", "line 3: \"5x\" is no number"},
                        {"1 2 nan\n", "node 0 has a coordinate that is not finite"},
                        {"nan 2 3\n", "not finite"},
                        {"-inf 2 3\n", "not finite"},
                        {"", "p.xyz: has no point"},
                        {"x y z\n", "has no point"}});
  EXPECT_THAT(refusal_of(read_surface_or_points(folder_.write("p.las", "1 2 3\n"))),
              HasSubstr("unknown surface format '.las'"));
}

}  // namespace
}  // namespace brainshift::io
