// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/header.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using std::chrono::nanoseconds;
using test_example::complaint;
using ::testing::HasSubstr;
using namespace std::string_literals;

Header example() {
  return {2, "TWELVE_BYTES", "brainshift_u", 0x0102030405060708u, 0x1122334455667788u, 0xfedcu};
}

void expect_refused(const std::string& bytes, const char* part) {
  test_example::expect_refused(decode_header(bytes), part);
}

TEST(Header, LayoutIsTheDocumentedOne) {
  EXPECT_EQ(encode_header(example()),
            "\0\2TWELVE_BYTESbrainshift_u\0\0\0\0\0\0\0\0"
            "\1\2\3\4\5\6\7\10\x11\x22\x33\x44\x55\x66\x77\x88\0\0\0\0\0\0\xfe\xdc"s);
}

TEST(Header, DecodeReturnsWhatWasEncoded) {
  for (const std::string& device : {""s, "x"s, std::string(20, 'd'), "T\xc3\xbcr"s}) {
    for (const std::uint16_t version : test_example::kVersions) {
      Header header = example();
      header.version = version;
      header.device = device;
      const auto decoded = value_or_fail(decode_header(encode_header(header)));
      EXPECT_EQ(decoded, header);
    }
  }
}

TEST(Header, WhatFollowsANulInAFieldIsLeftOut) {
  std::string bytes = encode_header(example());
  bytes[2 + 3] = '\0';
  bytes[14 + 5] = '\0';
  const auto decoded = value_or_fail(decode_header(bytes));
  EXPECT_EQ(decoded.type, "TWE");
  EXPECT_EQ(decoded.device, "brain");
}

TEST(Header, EveryTruncationIsRefused) {
  const std::string bytes = encode_header(example());
  for (std::size_t size = 0; size < kHeaderBytes; ++size) {
    expect_refused(bytes.substr(0, size), "header of");
  }
}

TEST(Header, WhatCannotBeAHeaderIsRefused) {
  const auto with = [](std::size_t at, char value) {
    std::string bytes = encode_header(example());
    bytes[at] = value;
    return bytes;
  };
  expect_refused(with(1, '\0'), "header version 0");
  expect_refused(with(1, '\3'), "header version 3");
  expect_refused(with(0, '\1'), "header version 258");
  expect_refused(with(2, '\0'), "type is empty");
  expect_refused(with(2, ' '), "type is not printable");
  expect_refused(with(13, '\xff'), "type is not printable");
  expect_refused(with(14, '\n'), "device name holds a control character");
  expect_refused("GET / HTTP/1.1\r\nHost: localhost\r\nAccept: text/html, */*\r\n\r\n", "version");
}

TEST(Header, ValidateNamesWhatIsWrong) {
  Header header = example();
  EXPECT_EQ(complaint(header), "");
  header.device = std::string(21, 'd');
  EXPECT_EQ(complaint(header), "device name has 21 bytes, must have at most 20");
  header.device = "a\0b"s;
  EXPECT_EQ(complaint(header), "device name holds a NUL");
  header = example();
  header.type = "THIRTEEN_BYTE";
  EXPECT_EQ(complaint(header), "message type has 13 bytes, must have at most 12");
}

TEST(Header, CrcIsComparedWithTheBodys) {
  EXPECT_TRUE(check_crc(example(), 0xfedcu));
  EXPECT_THAT(refusal_of(check_crc(example(), 0xfedbu), ErrorCode::kProtocol),
              HasSubstr("TWELVE_BYTES of \"brainshift_u\": the CRC-64"));
}

// Half a second is exact in both; 2106-02-07 is the last day.
TEST(Header, TimestampIsSecondsIn32Dot32FixedPoint) {
  EXPECT_EQ(to_timestamp(nanoseconds(1'500'000'000)), 0x1'8000'0000u);
  EXPECT_EQ(to_nanoseconds(0x1'8000'0000u), nanoseconds(1'500'000'000));
  EXPECT_EQ(to_timestamp(nanoseconds(4294967295'999'999'999)) >> 32, 0xffffffffu);
}

TEST(Header, ANanosecondSurvivesTheTimestamp) {
  for (const std::int64_t rest : {0, 1, 2, 3, 499'999'999, 500'000'001, 999'999'998, 999'999'999}) {
    for (const std::int64_t seconds : {0ll, 1ll, 1'700'000'000ll, 4'294'967'295ll}) {
      const nanoseconds time(seconds * 1'000'000'000 + rest);
      EXPECT_EQ(to_nanoseconds(to_timestamp(time)), time);
    }
  }
}

}  // namespace
}  // namespace brainshift::igtl
