// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/tracking.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::content_of;
using test_example::expect_refused;
using test_example::tracking_data;
using ::testing::HasSubstr;
using namespace std::string_literals;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// 1, 2, 3 down the first column, and so on: float32 of 1 is 3f800000.
TEST(Tracking, ATransformIsWrittenColumnByColumn) {
  Transform transform;
  transform.matrix << 1.0F, 0.0F, 0.0F, 0.0F, 2.0F, 0.0F, 0.0F, 0.0F, 3.0F, 0.0F, 0.0F, -1.0F;
  const std::string expected = "\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0"s + std::string(24, '\0') +
                               std::string(8, '\0') + "\xbf\x80\0\0"s;
  EXPECT_EQ(content_of(transform), expected);
}

TEST(Tracking, DecodeReturnsWhatWasEncoded) {
  const Transform transform{test_example::matrix()};
  const auto decoded = value_or_fail(decode_transform(content_of(transform)));
  EXPECT_EQ(decoded, transform);
  for (const TrackingData& data : {TrackingData{}, tracking_data()}) {
    const auto tools = value_or_fail(decode_tracking_data(content_of(data)));
    EXPECT_EQ(tools, data);
  }
}

TEST(Tracking, TheMatrixHasTheLastRowOfAnAffineMap) {
  const Eigen::Matrix4d matrix = to_matrix(test_example::matrix());
  EXPECT_EQ(matrix.row(3), Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0));
  EXPECT_EQ(matrix(0, 3), 12.5);
  EXPECT_EQ(matrix(1, 0), 1.0);
}

TEST(Tracking, AnotherSizeIsRefused) {
  const std::string transform = content_of(Transform{});
  for (std::size_t size = 0; size < transform.size(); ++size) {
    expect_refused(decode_transform(transform.substr(0, size)), "must be 48");
  }
  expect_refused(decode_transform(transform + '\0'), "49 bytes");
  const std::string tools = content_of(tracking_data());
  for (std::size_t size = 1; size < tools.size(); ++size) {
    if (size == 70) continue;  // the first tool alone
    expect_refused(decode_tracking_data(tools.substr(0, size)), "must be a multiple of 70");
  }
}

TEST(Tracking, NumbersThatAreNotFiniteAreRefused) {
  for (int i = 0; i < 12; ++i) {
    Transform transform;
    transform.matrix.data()[i] = i % 2 == 0 ? kNan : std::numeric_limits<float>::infinity();
    ASSERT_FALSE(validate(transform));
    EXPECT_EQ(validate(transform).error().code, ErrorCode::kNotFinite);
    expect_refused(decode_transform(content_of(transform)), "not finite");
    TrackingData data = tracking_data();
    data.tools[1].matrix = transform.matrix;
    EXPECT_FALSE(validate(data));
    expect_refused(decode_tracking_data(content_of(data)), "not finite");
  }
}

TEST(Tracking, UnknownToolTypesAreRefused) {
  for (const char type : {'\0', '\5', '\xff'}) {
    std::string content = content_of(tracking_data());
    content[70 + 20] = type;
    expect_refused(decode_tracking_data(content), "tool type");
  }
}

TEST(Tracking, ALongNameIsRefused) {
  TrackingData data = tracking_data();
  data.tools[0].name = std::string(21, 'n');
  ASSERT_FALSE(validate(data));
  EXPECT_EQ(validate(data).error().message, "name of a tool has 21 bytes, must have at most 20");
}

}  // namespace
}  // namespace brainshift::igtl
