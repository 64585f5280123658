// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/poly_data.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::content_of;
using test_example::poly_data;
using ::testing::HasSubstr;
using namespace std::string_literals;

std::string poly_message_of(const PolyData& data) {
  const Status status = validate(data);
  return status ? "" : status.error().message;
}

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
    const auto decoded = value_or_fail(decode_poly_data(content_of(data)));
    EXPECT_TRUE(decoded == data);
  }
}

TEST(PolyData, AttributesOfCellsAndColourTablesSurvive) {
  PolyData data = poly_data();
  data.attributes.push_back(
      {"of cells", AttributeKind::kVector, true, Eigen::MatrixXf::Ones(3, 6)});
  data.attributes.push_back({"table", AttributeKind::kRgba, false, Eigen::MatrixXf::Ones(4, 256)});
  data.attributes.push_back({"", AttributeKind::kScalar, false, Eigen::MatrixXf::Ones(127, 4)});
  ASSERT_EQ(poly_message_of(data), "");
  const auto decoded = value_or_fail(decode_poly_data(content_of(data)));
  EXPECT_TRUE(decoded == data);
}

TEST(PolyData, NamesOfEveryLengthSurvive) {
  for (std::size_t size = 0; size <= 255; ++size) {
    PolyData data = poly_data();
    data.attributes[1].name = std::string(size, 'n');
    const auto decoded = value_or_fail(decode_poly_data(content_of(data)));
    EXPECT_TRUE(decoded == data) << size;
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
  PolyData data = poly_data();
  EXPECT_EQ(poly_message_of(data), "");
  data.points(1, 2) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(poly_message_of(data), "a point is not finite");
  data = poly_data();
  data.attributes[0].values.resize(4, 4);
  EXPECT_EQ(poly_message_of(data), "attribute \"displacement_mm\" has 4 components, must have 3");
  data = poly_data();
  data.attributes[1].values.resize(128, 4);
  EXPECT_EQ(poly_message_of(data), "attribute \"sd_mm\" has 128 components, must have 1 to 127");
  data = poly_data();
  data.attributes[1].values.setOnes(1, 5);
  EXPECT_EQ(poly_message_of(data), "attribute \"sd_mm\" has 5 tuples for 4 points");
  data = poly_data();
  data.attributes[1].name = std::string(256, 'n');
  EXPECT_THAT(poly_message_of(data), HasSubstr("attribute name has 256 bytes"));
  data = poly_data();
  data.attributes.resize(257);
  EXPECT_EQ(poly_message_of(data), "257 attributes, must be at most 256");
}

TEST(PolyData, ValuesOfOtherShapesAreUnequal) {
  PolyData other = poly_data();
  other.attributes[0].values.resize(3, 3);
  EXPECT_FALSE(other == poly_data());
  other = poly_data();
  other.points.resize(3, 5);
  EXPECT_FALSE(other == poly_data());
}

}  // namespace
}  // namespace brainshift::igtl
