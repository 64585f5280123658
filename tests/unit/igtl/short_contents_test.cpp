// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/short_contents.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::complaint;
using test_example::content_of;
using test_example::expect_refused;
using test_example::expect_round_trip;
using test_example::point_list;
using test_example::tracking_data;
using ::testing::HasSubstr;
using namespace std::string_literals;

TEST(ShortContents, LayoutsAreTheDocumentedOnes) {
  EXPECT_EQ(content_of(Text{"text", 3}), "\0\3\0\4text"s);
  EXPECT_EQ(content_of(StatusReport{13, -2, "name", "text"}),
            "\0\15\xff\xff\xff\xff\xff\xff\xff\xfename"s + std::string(16, '\0') + "text\0"s);
  EXPECT_EQ(content_of(Capability{{"IMAGE", "TWELVE_BYTES"}}), "IMAGE\0\0\0\0\0\0\0TWELVE_BYTES"s);
  EXPECT_EQ(content_of(StatusRequest{}) + content_of(CapabilityRequest{}), "");
}

TEST(ShortContents, DecodeReturnsWhatWasEncoded) {
  for (const Text& text : {Text{}, test_example::text(), Text{std::string(65535, 'x'), kUtf8}}) {
    expect_round_trip(text, decode_text);
  }
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  for (const StatusReport& report :
       {StatusReport{}, test_example::status_report(),
        StatusReport{65535, kMin, std::string(20, 'e'), std::string(65535, 't')}}) {
    expect_round_trip(report, decode_status_report);
  }
  for (const Capability& capability : {Capability{}, Capability{{"IMAGE", "TWELVE_BYTES"}}}) {
    expect_round_trip(capability, decode_capability);
  }
}

TEST(ShortContents, AStatusWithoutTheFinalNulIsReadToItsEnd) {
  std::string content = content_of(StatusReport{1, 0, "", "text"});
  content.pop_back();
  ASSERT_TRUE(decode_status_report(content));
  EXPECT_EQ(decode_status_report(content)->text, "text");
  EXPECT_EQ(decode_status_report(content + "\0more"s)->text, "text");
  EXPECT_EQ(decode_status_report(content.substr(0, 30))->text, "");
}

TEST(ShortContents, EveryTruncationIsRefused) {
  const std::string text = content_of(Text{"text", 3});
  for (std::size_t size = 0; size < text.size(); ++size) {
    expect_refused(decode_text(text.substr(0, size)), size < 4 ? "at least 4" : "are left");
  }
  expect_refused(decode_text(text + '\0'), "text of 4 bytes, 5 are left");
  const std::string report = content_of(StatusReport{});
  for (std::size_t size = 0; size < 30; ++size) {
    expect_refused(decode_status_report(report.substr(0, size)), "at least 30");
  }
  for (std::size_t size = 1; size < 12; ++size) {
    expect_refused(decode_capability("TWELVE_BYTES"s.substr(0, size)), "multiple of 12");
  }
}

TEST(ShortContents, TextsThatAreTooLongAreRefused) {
  EXPECT_EQ(complaint(Text{std::string(65536, 'x'), 3}),
            "text has 65536 bytes, must have at most 65535");
  EXPECT_EQ(complaint(StatusReport{1, 0, std::string(21, 'e'), ""}),
            "error name has 21 bytes, must have at most 20");
  EXPECT_EQ(complaint(StatusReport{1, 0, "", std::string(65536, 'x')}),
            "text has 65536 bytes, must have at most 65535");
  EXPECT_EQ(complaint(StatusReport{1, 0, "", "a\0b"s}), "text holds a NUL");
  EXPECT_EQ(complaint(Capability{{"THIRTEEN_BYTE"}}),
            "message type has 13 bytes, must have at most 12");
  EXPECT_EQ(complaint(Capability{{""}}), "a message type is empty");
  expect_refused(decode_capability(std::string(12, '\0')), "a message type is empty");
  expect_refused(decode_status_report(std::string(30, '\0') + std::string(65536, 'x')),
                 "text has 65536 bytes");
}

// ---- TRANSFORM, TDATA ----

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
  expect_round_trip(Transform{test_example::matrix()}, decode_transform);
  for (const TrackingData& data : {TrackingData{}, tracking_data()}) {
    expect_round_trip(data, decode_tracking_data);
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
    refusal_of(validate(transform), ErrorCode::kNotFinite);
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
  EXPECT_EQ(complaint(data), "name of a tool has 21 bytes, must have at most 20");
}

// ---- POINT ----

TEST(PointList, DecodeReturnsWhatWasEncoded) {
  for (const PointList& list : {PointList{}, point_list()}) {
    EXPECT_EQ(content_of(list).size(), 136 * list.points.size());
    expect_round_trip(list, decode_point_list);
  }
}

TEST(PointList, AnotherSizeIsRefused) {
  const std::string content = content_of(point_list());
  for (std::size_t size = 1; size < content.size(); ++size) {
    if (size == 136) continue;  // the first point alone
    expect_refused(decode_point_list(content.substr(0, size)), "must be a multiple of 136");
  }
}

TEST(PointList, NumbersThatAreNotFiniteAreRefused) {
  for (int i = 0; i < 4; ++i) {
    PointList list = point_list();
    float& number = i < 3 ? list.points[1].position[i] : list.points[1].diameter;
    number = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THAT(refusal_of(validate(list), ErrorCode::kNotFinite), HasSubstr("not finite"));
    expect_refused(decode_point_list(content_of(list)), "not finite");
  }
}

TEST(PointList, LongTextsAreRefused) {
  const auto changed = [](const auto& change) {
    PointList list = point_list();
    change(list.points);
    return complaint(list);
  };
  EXPECT_EQ(changed([](auto& points) { points[1].name += 'n'; }),
            "name of a point has 65 bytes, must have at most 64");
  EXPECT_EQ(changed([](auto& points) { points[1].group += 'g'; }),
            "group of a point has 33 bytes, must have at most 32");
  EXPECT_EQ(changed([](auto& points) { points[1].owner += 'o'; }),
            "owner of a point has 21 bytes, must have at most 20");
  EXPECT_EQ(changed([](auto& points) { points[0].name[2] = '\0'; }), "name of a point holds a NUL");
}

}  // namespace
}  // namespace brainshift::igtl
