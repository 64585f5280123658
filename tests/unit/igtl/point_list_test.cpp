// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/point_list.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::content_of;
using test_example::point_list;
using ::testing::HasSubstr;

void expect_invalid(const PointList& list, const char* part) {
  EXPECT_THAT(sentence_of(validate(list)), HasSubstr(part));
}

TEST(PointList, DecodeReturnsWhatWasEncoded) {
  for (const PointList& list : {PointList{}, point_list()}) {
    const std::string content = content_of(list);
    EXPECT_EQ(content.size(), 136 * list.points.size());
    const auto decoded = value_or_fail(decode_point_list(content));
    EXPECT_EQ(decoded, list);
  }
}

TEST(PointList, AnotherSizeIsRefused) {
  const std::string content = content_of(point_list());
  for (std::size_t size = 1; size < content.size(); ++size) {
    if (size == 136) continue;  // the first point alone
    const auto decoded = decode_point_list(content.substr(0, size));
    ASSERT_FALSE(decoded) << size;
    EXPECT_EQ(decoded.error().code, ErrorCode::kProtocol);
  }
}

TEST(PointList, NumbersThatAreNotFiniteAreRefused) {
  for (int i = 0; i < 4; ++i) {
    PointList list = point_list();
    float& number = i < 3 ? list.points[1].position[i] : list.points[1].diameter;
    number = std::numeric_limits<float>::quiet_NaN();
    expect_invalid(list, "not finite");
    EXPECT_EQ(validate(list).error().code, ErrorCode::kNotFinite);
    EXPECT_FALSE(decode_point_list(content_of(list)));
  }
}

TEST(PointList, LongTextsAreRefused) {
  PointList list = point_list();
  list.points[1].name += 'n';
  expect_invalid(list, "name of a point has 65 bytes, must have at most 64");
  list = point_list();
  list.points[1].group += 'g';
  expect_invalid(list, "group of a point has 33 bytes, must have at most 32");
  list = point_list();
  list.points[1].owner += 'o';
  expect_invalid(list, "owner of a point has 21 bytes, must have at most 20");
  list = point_list();
  list.points[0].name[2] = '\0';
  expect_invalid(list, "name of a point holds a NUL");
}

}  // namespace
}  // namespace brainshift::igtl
