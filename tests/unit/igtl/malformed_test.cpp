// SPDX-License-Identifier: Apache-2.0
// A corpus of damaged messages of every type in both versions: cut at every byte, every byte
// changed, every number of a body replaced by the largest, with and without a CRC that fits. None
// is taken for the message that it was, and none ends the process (the sanitizer presets look
// closer).
#include <gtest/gtest.h>

#include "common/igtl/crc64.hpp"
#include "common/igtl/stream_reader.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::contents;
using test_example::encoded;
using test_example::envelope;

enum class End { kMessage, kMoreToCome, kRefused };

// What a reader makes of these bytes; decodes what comes out of it.
End read(std::string_view bytes) {
  StreamReader reader;
  while (!bytes.empty()) {
    const auto packet = reader.read(bytes);
    if (!packet) {
      EXPECT_EQ(packet.error().code, ErrorCode::kProtocol);
      EXPECT_EQ(packet.error().message.find('\n'), std::string::npos);
      return End::kRefused;
    }
    if (*packet) return (*packet)->skipped ? End::kRefused : End::kMessage;
  }
  return End::kMoreToCome;
}

std::string with_right_crc(std::string bytes) {
  std::uint64_t crc = crc64(std::string_view(bytes).substr(kHeaderBytes));
  for (std::size_t i = 8; i-- > 0; crc >>= 8) bytes[50 + i] = static_cast<char>(crc & 0xffu);
  return bytes;
}

template <typename Use>
void for_each_message(const Use& use) {
  for (const std::uint16_t version : test_example::kVersions) {
    for (const auto& [name, content] : contents()) {
      SCOPED_TRACE(name + ", version " + std::to_string(version));
      use(encoded(envelope(version), content), content);
    }
  }
}

TEST(Malformed, TheCorpusItselfIsRead) {
  for_each_message([](const std::string& bytes, const Content&) {
    EXPECT_EQ(read(bytes), End::kMessage);
    EXPECT_EQ(with_right_crc(bytes), bytes);
  });
}

TEST(Malformed, EveryTruncationWaitsForTheRest) {
  for_each_message([](const std::string& bytes, const Content&) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      ASSERT_EQ(read(std::string_view(bytes).substr(0, size)), End::kMoreToCome) << size;
      ASSERT_FALSE(decode(std::string_view(bytes).substr(0, size))) << size;
    }
  });
}

TEST(Malformed, EveryFlippedBitOfTheBodyIsRefused) {
  for_each_message([](const std::string& bytes, const Content&) {
    for (std::size_t i = 8 * kHeaderBytes; i < 8 * bytes.size(); ++i) {
      std::string damaged = bytes;
      damaged[i / 8] = static_cast<char>(damaged[i / 8] ^ (1 << (i % 8)));
      ASSERT_EQ(read(damaged), End::kRefused) << i;
    }
  });
}

// The CRC does not cover the header: a damaged name, timestamp or padding passes, and a damaged
// type may be another's. All else is refused or waits for a body that never comes.
TEST(Malformed, EveryChangedByteOfTheHeaderIsRefusedOrChangesNothingButNameAndTime) {
  for_each_message([](const std::string& bytes, const Content& content) {
    for (std::size_t at = 0; at < kHeaderBytes; ++at) {
      for (const int change : {0x01, 0x80, 0xff}) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ change);
        (void)read(damaged);
        const auto message = decode(damaged);
        const bool padding = at > 2 + type_of(content).size() && at < 14;
        const bool free = padding || (at >= 14 && at < 42);
        if (!free) {
          // Version 1 of a message without a body differs from version 2 in nothing else.
          const bool no_body = bytes.size() == kHeaderBytes && at == 1;
          ASSERT_TRUE(!message || no_body || !(message->content == content)) << at << " " << change;
        } else if (message) {
          ASSERT_TRUE(message->content == content) << at << " " << change;
        }
      }
    }
  });
}

TEST(Malformed, EveryChangedByteBehindARightCrcIsRefusedOrDecoded) {
  for_each_message([](const std::string& bytes, const Content&) {
    for (std::size_t at = kHeaderBytes; at < bytes.size(); ++at) {
      for (const int change : {0x01, 0x7f, 0x80, 0xff}) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ change);
        const auto message = decode(with_right_crc(damaged));
        if (!message) {
          ASSERT_EQ(message.error().code, ErrorCode::kProtocol);
          continue;
        }
        std::string again;
        if (encode(message->envelope, message->content, again)) {
          ASSERT_TRUE(decode(again)) << "encoded, but not decoded: byte " << at;
        }
      }
    }
  });
}

TEST(Malformed, HugeNumbersBehindARightCrcAreRefusedOrDecoded) {
  for_each_message([](const std::string& bytes, const Content&) {
    for (const std::size_t width : {2, 4, 8}) {
      for (const char value : {'\xff', '\x7f', '\0'}) {
        for (std::size_t at = kHeaderBytes; at + width <= bytes.size(); ++at) {
          std::string damaged = bytes;
          damaged.replace(at, width, width, value);
          (void)decode(with_right_crc(damaged));
        }
      }
    }
  });
}

TEST(Malformed, EveryTruncatedBodyBehindARightHeaderIsRefusedOrDecoded) {
  for_each_message([](const std::string& bytes, const Content& content) {
    const auto header = decode_header(bytes);
    ASSERT_TRUE(header);
    for (std::size_t size = kHeaderBytes; size < bytes.size(); ++size) {
      const auto message =
          decode(*header, std::string_view(bytes).substr(kHeaderBytes, size - kHeaderBytes));
      // Part of a list is a shorter list, and a STATUS may lack its last NUL: nothing else is left.
      if (message) {
        const bool may_be_cut = std::holds_alternative<TrackingData>(content) ||
                                std::holds_alternative<PointList>(content) ||
                                std::holds_alternative<StatusReport>(content) ||
                                std::holds_alternative<Capability>(content) ||
                                bytes.size() == size + 1 || size == kHeaderBytes;
        ASSERT_TRUE(may_be_cut) << size;
      }
    }
  });
}

TEST(Malformed, EveryClaimOfAHugeBodyIsRefusedAtOnce) {
  for_each_message([](const std::string& bytes, const Content&) {
    for (int shift = 28; shift < 64; ++shift) {
      Header header = *decode_header(bytes);
      header.body_bytes = std::uint64_t{1} << shift;
      EXPECT_EQ(read(encode_header(header)), End::kRefused) << shift;
    }
  });
}

}  // namespace
}  // namespace brainshift::igtl
