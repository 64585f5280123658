// SPDX-License-Identifier: Apache-2.0
#include "common/wire/frame.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

namespace brainshift::wire {
namespace {

using ::testing::HasSubstr;

const std::string kPayload = "nine bytes and some more \x00\xff";

std::string sample_frame() {
  return encode_frame(MessageType::kObservation, 0x1122334455667788ull, kPayload);
}

void expect_frame_refused(const std::string& bytes, const char* field) {
  EXPECT_THAT(refusal_of(decode_frame(bytes), ErrorCode::kProtocol), HasSubstr(field));
}

std::string with_byte(std::string bytes, std::size_t offset, unsigned char value) {
  bytes[offset] = static_cast<char>(value);
  return bytes;
}

TEST(Frame, DecodeReturnsWhatWasEncodedForEveryType) {
  for (std::uint16_t type = 1; type <= 15; ++type) {
    if (type == 8) continue;  // version 1's
    for (const std::string& payload : {std::string(), kPayload, std::string(100000, 'x')}) {
      const std::string bytes = encode_frame(static_cast<MessageType>(type), ~0ull - type, payload);
      const auto frame = value_or_fail(decode_frame(bytes));
      EXPECT_EQ(frame.type, static_cast<MessageType>(type));
      EXPECT_EQ(frame.request_id, ~0ull - type);
      EXPECT_EQ(frame.payload, payload);
    }
  }
}

// CRC-32 by zlib of Python: crc32(frame[:12] + frame[16:]).
TEST(Frame, LayoutIsTheDocumentedOne) {
  const std::string bytes = encode_frame(MessageType::kUpdate, 0x0102030405060708ull, "123456789");
  const std::string expected(
      "BSFT\x02\x00\x0c\x00\x09\x00\x00\x00\x3c\x80\x9d\x2f\x08\x07\x06\x05\x04\x03\x02\x01"
      "123456789",
      33);
  EXPECT_EQ(bytes, expected);
}

TEST(Frame, EveryTruncationIsRefused) {
  const std::string bytes = sample_frame();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    expect_frame_refused(bytes.substr(0, size), size < kHeaderBytes ? "header" : "payload size");
  }
}

TEST(Frame, TrailingBytesAndConcatenatedFramesAreRefused) {
  expect_frame_refused(sample_frame() + '\0', "payload size");
  expect_frame_refused(sample_frame() + sample_frame(), "payload size");
}

TEST(Frame, EveryFlippedBitIsNoticed) {
  const std::string bytes = sample_frame();
  for (std::size_t offset = 0; offset < bytes.size(); ++offset) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = bytes;
      damaged[offset] = static_cast<char>(damaged[offset] ^ (1 << bit));
      EXPECT_FALSE(decode_frame(damaged)) << "offset " << offset << " bit " << bit;
    }
  }
}

TEST(Frame, EachHeaderFieldIsNamedWhenItIsWrong) {
  for (std::size_t i = 0; i < 4; ++i)
    expect_frame_refused(with_byte(sample_frame(), i, 'x'), "magic");
  expect_frame_refused(with_byte(sample_frame(), 4, 0), "version");
  expect_frame_refused(with_byte(sample_frame(), 4, 1), "version");
  expect_frame_refused(with_byte(sample_frame(), 5, 1), "version");
  expect_frame_refused(with_byte(sample_frame(), 6, 0), "type");
  expect_frame_refused(with_byte(sample_frame(), 6, 8), "type");
  expect_frame_refused(with_byte(sample_frame(), 6, 16), "type");
  expect_frame_refused(with_byte(sample_frame(), 7, 1), "type");
  expect_frame_refused(with_byte(sample_frame(), 8, 3), "payload size");
  expect_frame_refused(with_byte(sample_frame(), 12, 0), "CRC-32");
}

TEST(Frame, AStatedSizeAboveTheCapIsRefusedBeforeThePayloadIsLookedAt) {
  std::string header = sample_frame().substr(0, kHeaderBytes);
  header.replace(8, 4, std::string("\x01\x00\x00\x04", 4));  // 64 MiB + 1
  expect_frame_refused(header, "must be at most 67108864");
  header.replace(8, 4, std::string("\xff\xff\xff\xff", 4));
  expect_frame_refused(header, "must be at most 67108864");
}

}  // namespace
}  // namespace brainshift::wire
