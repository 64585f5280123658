// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/short_contents.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::content_of;
using test_example::expect_refused;
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
    const auto decoded = value_or_fail(decode_text(content_of(text)));
    EXPECT_EQ(decoded, text);
  }
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  for (const StatusReport& report :
       {StatusReport{}, test_example::status_report(),
        StatusReport{65535, kMin, std::string(20, 'e'), std::string(65535, 't')}}) {
    const auto decoded = value_or_fail(decode_status_report(content_of(report)));
    EXPECT_EQ(decoded, report);
  }
  for (const Capability& capability : {Capability{}, Capability{{"IMAGE", "TWELVE_BYTES"}}}) {
    const auto decoded = value_or_fail(decode_capability(content_of(capability)));
    EXPECT_EQ(decoded, capability);
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
  const auto message = [](const auto& value) {
    const Status status = validate(value);
    return status ? "" : status.error().message;
  };
  EXPECT_EQ(message(Text{std::string(65536, 'x'), 3}),
            "text has 65536 bytes, must have at most 65535");
  EXPECT_EQ(message(StatusReport{1, 0, std::string(21, 'e'), ""}),
            "error name has 21 bytes, must have at most 20");
  EXPECT_EQ(message(StatusReport{1, 0, "", std::string(65536, 'x')}),
            "text has 65536 bytes, must have at most 65535");
  EXPECT_EQ(message(StatusReport{1, 0, "", "a\0b"s}), "text holds a NUL");
  EXPECT_EQ(message(Capability{{"THIRTEEN_BYTE"}}),
            "message type has 13 bytes, must have at most 12");
  EXPECT_EQ(message(Capability{{""}}), "a message type is empty");
  expect_refused(decode_capability(std::string(12, '\0')), "a message type is empty");
  expect_refused(decode_status_report(std::string(30, '\0') + std::string(65536, 'x')),
                 "text has 65536 bytes");
}

}  // namespace
}  // namespace brainshift::igtl
