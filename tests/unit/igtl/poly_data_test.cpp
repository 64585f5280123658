// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/poly_data.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::complaint;
using test_example::content_of;
using test_example::expect_round_trip;
using test_example::poly_data;
using ::testing::HasSubstr;
using namespace std::string_literals;

void expect_poly_data_refused(const std::string& content, const char* part) {
  test_example::expect_refused(decode_poly_data(content), part);
}

std::string with_poly(std::size_t at, const std::string& bytes) {
  return content_of(poly_data()).replace(at, bytes.size(), bytes);
}

// Where the parts of poly_data() begin.
constexpr std::size_t kPoints = 40;
constexpr std::size_t kVertices = kPoints + 4 * 12;
constexpr std::size_t kLines = kVertices + 8;
constexpr std::size_t kPolygons = kLines + 16 + 12;
constexpr std::size_t kStrips = kPolygons + 16 + 20;
constexpr std::size_t kAttributes = kStrips + 20;

TEST(PolyData, DecodeReturnsWhatWasEncoded) {
  PolyData points_only;
  points_only.points = poly_data().points;
  for (const PolyData& data : {poly_data(), points_only, PolyData{}}) {
    expect_round_trip(data, decode_poly_data);
  }
}

TEST(PolyData, AttributesOfCellsAndColourTablesSurvive) {
  PolyData data = poly_data();
  data.attributes.push_back(
      {"of cells", AttributeKind::kVector, true, Eigen::MatrixXf::Ones(3, 6)});
  data.attributes.push_back({"table", AttributeKind::kRgba, false, Eigen::MatrixXf::Ones(4, 256)});
  data.attributes.push_back({"", AttributeKind::kScalar, false, Eigen::MatrixXf::Ones(127, 4)});
  ASSERT_EQ(complaint(data), "");
  expect_round_trip(data, decode_poly_data);
}

TEST(PolyData, NamesOfEveryLengthSurvive) {
  for (std::size_t size = 0; size <= 255; ++size) {
    PolyData data = poly_data();
    data.attributes[1].name = std::string(size, 'n');
    SCOPED_TRACE(size);
    expect_round_trip(data, decode_poly_data);
  }
}

TEST(PolyData, SizesBeyondTheContentAreRefused) {
  const std::string huge = "\xff\xff\xff\xff";
  expect_poly_data_refused("", "0 bytes");
  expect_poly_data_refused(with_poly(0, huge), "points of 51539607540 bytes");
  expect_poly_data_refused(with_poly(8, huge), "vertices of 4294967295 bytes");
  expect_poly_data_refused(with_poly(16, huge), "lines of 4294967295 bytes");
  expect_poly_data_refused(with_poly(24, huge), "polygons of 4294967295 bytes");
  expect_poly_data_refused(with_poly(32, huge), "triangle strips of 4294967295 bytes");
  expect_poly_data_refused(with_poly(36, huge), "4294967295 attributes, must be at most 256");
  expect_poly_data_refused(with_poly(36, "\0\0\1\0"s), "attribute headers of 1536 bytes");
  expect_poly_data_refused(with_poly(kAttributes + 2, huge),
                           "attribute \"displacement_mm\" of 51539607540 bytes");
  expect_poly_data_refused(with_poly(kAttributes + 1, "\xff"s + huge), "of 4380866640900 bytes");
}

TEST(PolyData, CellsThatDoNotAddUpAreRefused) {
  expect_poly_data_refused(with_poly(4, "\0\0\0\2"s), "vertices: 2 cells stated, 1 are there");
  expect_poly_data_refused(with_poly(12, "\0\0\0\1"s), "lines: 1 cells stated, 2 are there");
  expect_poly_data_refused(with_poly(8, "\0\0\0\7"s),
                           "vertices of 7 bytes, must be a multiple of 4");
  expect_poly_data_refused(with_poly(kVertices, "\0\0\0\2"s),
                           "vertices: a cell of 2 points, 1 numbers are left");
  expect_poly_data_refused(with_poly(kVertices + 4, "\0\0\0\4"s), "vertices: point 4, 4 are there");
  expect_poly_data_refused(with_poly(kLines + 4, "\xff\xff\xff\xff"),
                           "lines: point 4294967295, 4 are there");
  expect_poly_data_refused(with_poly(kPolygons, "\x80\0\0\0"s),
                           "polygons: a cell of 2147483648 points");
  expect_poly_data_refused(with_poly(kStrips + 16, "\0\0\0\5"s), "triangle strips: point 5");
}

TEST(PolyData, AttributesThatFitNothingAreRefused) {
  expect_poly_data_refused(with_poly(kAttributes, "\5"), "attribute kind 5");
  expect_poly_data_refused(with_poly(kAttributes, "\x20"), "attribute kind 32");
  expect_poly_data_refused(with_poly(kAttributes + 1, "\0"s), "bytes after the last attribute");
  expect_poly_data_refused(with_poly(kAttributes + 6, "\1"), "has 1 components, must have 3");
  expect_poly_data_refused(with_poly(kAttributes + 2, "\0\0\0\3"s),
                           "12 bytes after the last attribute");
  expect_poly_data_refused(content_of(poly_data()) + "\0\0\0\0"s,
                           "4 bytes after the last attribute");
}

TEST(PolyData, ANameWithoutEndIsRefused) {
  PolyData data;
  data.attributes = {{"n", AttributeKind::kScalar, false, Eigen::MatrixXf::Ones(1, 0)}};
  std::string content = content_of(data);
  content.resize(content.size() - 1);
  expect_poly_data_refused(content, "does not end within 256 bytes");
  content += std::string(400, 'n');
  expect_poly_data_refused(content, "does not end within 256 bytes");
}

TEST(PolyData, EveryTruncationIsRefused) {
  const std::string content = content_of(poly_data());
  for (std::size_t size = 0; size < content.size(); ++size) {
    EXPECT_FALSE(decode_poly_data(content.substr(0, size))) << size;
  }
}

TEST(PolyData, ValidateNamesWhatIsWrong) {
  const auto changed = [](const auto& change) {
    PolyData data = poly_data();
    change(data);
    return complaint(data);
  };
  EXPECT_EQ(changed([](PolyData&) {}), "");
  EXPECT_EQ(changed([](PolyData& d) { d.points(1, 2) = std::numeric_limits<float>::quiet_NaN(); }),
            "a point is not finite");
  EXPECT_EQ(changed([](PolyData& d) { d.attributes[0].values.resize(4, 4); }),
            "attribute \"displacement_mm\" has 4 components, must have 3");
  EXPECT_EQ(changed([](PolyData& d) { d.attributes[1].values.resize(128, 4); }),
            "attribute \"sd_mm\" has 128 components, must have 1 to 127");
  EXPECT_EQ(changed([](PolyData& d) { d.attributes[1].values.setOnes(1, 5); }),
            "attribute \"sd_mm\" has 5 tuples for 4 points");
  EXPECT_THAT(changed([](PolyData& d) { d.attributes[1].name = std::string(256, 'n'); }),
              HasSubstr("attribute name has 256 bytes"));
  EXPECT_EQ(changed([](PolyData& d) { d.attributes.resize(257); }),
            "257 attributes, must be at most 256");
}

TEST(PolyData, ValuesOfOtherShapesAreUnequal) {
  PolyData other = poly_data();
  other.attributes[0].values.resize(3, 3);
  EXPECT_FALSE(other == poly_data());
  other = poly_data();
  other.points.resize(3, 5);
  EXPECT_FALSE(other == poly_data());
}

// ---- surfaces ----

using Triangles = Eigen::Matrix<int, 3, Eigen::Dynamic>;

PolyData square() {
  PolyData data;
  data.points.resize(3, 4);
  data.points << 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 1.0F, 0.5F, 0.5F, 0.5F, 0.5F;
  return data;
}

Triangles triangles(std::initializer_list<int> columns) {
  return Eigen::Map<const Triangles>(columns.begin(), 3,
                                     static_cast<Eigen::Index>(columns.size() / 3));
}

TEST(Surface, ASurfaceComesBackFromItsPolyData) {
  TriangleSurface surface;
  surface.vertices = test_example::poly_data().points.cast<double>();
  surface.triangles = triangles({0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
  const PolyData data = from_surface(surface);
  EXPECT_TRUE(validate(data));
  EXPECT_EQ(data.polygons.count, 4u);
  const auto back = value_or_fail(to_surface(data));
  EXPECT_EQ(back.vertices, surface.vertices);
  EXPECT_EQ(back.triangles, surface.triangles);
}

TEST(Surface, APolygonBecomesAFan) {
  PolyData data = square();
  data.polygons.add({0, 1, 2, 3});
  const auto surface = value_or_fail(to_surface(data));
  EXPECT_EQ(surface.triangles, triangles({0, 1, 2, 0, 2, 3}));
}

// Both triangles of the strip 0 1 3 2 of a square face the same way.
TEST(Surface, AStripKeepsItsOrientation) {
  PolyData data = square();
  data.triangle_strips.add({0, 1, 3, 2});
  const auto surface = value_or_fail(to_surface(data));
  ASSERT_EQ(surface.num_triangles(), 2);
  for (int t = 0; t < 2; ++t) {
    const auto corner = [&](int i) -> Vec3 {
      return surface.vertices.col(surface.triangles(i, t));
    };
    const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    EXPECT_EQ(normal, Vec3(0.0, 0.0, 1.0));
  }
}

TEST(Surface, TrianglesThatNameAPointTwiceAreLeftOut) {
  PolyData data = square();
  data.triangle_strips.add({0, 1, 2, 2, 3});
  data.polygons.add({1, 1, 2});
  const auto surface = value_or_fail(to_surface(data));
  EXPECT_EQ(surface.triangles, triangles({0, 1, 2}));
}

TEST(Surface, PointsAndLinesAloneAreNoSurface) {
  PolyData data = square();
  data.vertices.add({0});
  data.lines.add({0, 1, 2});
  data.polygons.add({0, 1});
  data.polygons.add({});
  refusal_of(to_surface(data), ErrorCode::kEmptySet);
}

}  // namespace
}  // namespace brainshift::igtl
