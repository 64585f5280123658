// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/stream_reader.hpp"

#include <gmock/gmock.h>

#include "common/igtl/crc64.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using test_example::contents;
using test_example::encoded;
using test_example::envelope;
using ::testing::HasSubstr;

// A message of any type and body, with the right CRC.
std::string framed(const std::string& type, const std::string& body) {
  return encode_header({1, type, "device", 0, body.size(), crc64(body)}) + body;
}

// The packets of a stream that is cut into pieces of this many bytes.
std::vector<Packet> read_all(StreamReader& reader, std::string_view stream, std::size_t piece) {
  std::vector<Packet> packets;
  for (; !stream.empty(); stream.remove_prefix(std::min(piece, stream.size()))) {
    std::string_view bytes = stream.substr(0, piece);
    while (!bytes.empty()) {
      auto packet = reader.read(bytes);
      if (!packet) {
        ADD_FAILURE() << packet.error().message;
        return packets;
      }
      if (*packet) packets.push_back(std::move(**packet));
    }
  }
  return packets;
}

// The first error; empty if there is none.
std::string error_of(StreamReader& reader, std::string_view stream) {
  while (!stream.empty()) {
    const auto packet = reader.read(stream);
    if (!packet) {
      EXPECT_EQ(packet.error().code, ErrorCode::kProtocol);
      return packet.error().message;
    }
  }
  return "";
}

TEST(StreamReader, HoweverTheBytesArriveTheMessagesAreTheSame) {
  std::string stream;
  for (const auto& [name, content] : contents()) stream += encoded(envelope(2), content);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{57}, std::size_t{58},
                                  std::size_t{59}, std::size_t{1000}, stream.size()}) {
    StreamReader reader;
    const auto packets = read_all(reader, stream, piece);
    ASSERT_EQ(packets.size(), contents().size()) << piece;
    for (std::size_t i = 0; i < packets.size(); ++i) {
      EXPECT_FALSE(packets[i].skipped);
      const auto message = value_or_fail(decode(packets[i].header, packets[i].body));
      EXPECT_TRUE(message.content == contents()[i].second) << contents()[i].first;
      EXPECT_EQ(message.envelope, envelope(2));
    }
  }
}

TEST(StreamReader, AMessageIsGivenOutWithItsLastByte) {
  const std::string stream = encoded(envelope(), test_example::text());
  StreamReader reader;
  for (std::size_t i = 0; i < stream.size(); ++i) {
    std::string_view byte = std::string_view(stream).substr(i, 1);
    const auto packet = value_or_fail(reader.read(byte));
    EXPECT_EQ(packet.has_value(), i + 1 == stream.size()) << i;
    EXPECT_TRUE(byte.empty());
  }
}

TEST(StreamReader, AMessageWithoutABodyIsGivenOutWithItsHeader) {
  const std::string stream = encoded(envelope(1), StatusRequest{});
  ASSERT_EQ(stream.size(), kHeaderBytes);
  StreamReader reader;
  EXPECT_EQ(read_all(reader, stream + stream, 13).size(), 2u);
}

TEST(StreamReader, BytesAfterAMessageAreLeft) {
  std::string_view bytes;
  const std::string stream = encoded(envelope(), StatusRequest{}) + "the next";
  bytes = stream;
  StreamReader reader;
  ASSERT_TRUE(reader.read(bytes));
  EXPECT_EQ(bytes, "the next");
}

TEST(StreamReader, UnknownTypesAreSkippedAndReported) {
  const std::string stream = framed("VIDEO", std::string(300000, 'v')) +
                             encoded(envelope(2), test_example::text()) + framed("COMMAND", "");
  StreamReader reader;
  std::size_t most = 0;
  std::vector<Packet> packets;
  for (std::size_t at = 0; at < stream.size(); at += 1000) {
    for (auto& packet : read_all(reader, std::string_view(stream).substr(at, 1000), 1000)) {
      packets.push_back(std::move(packet));
    }
    if (packets.empty()) most = std::max(most, reader.held_bytes());
  }
  ASSERT_EQ(packets.size(), 3u);
  EXPECT_EQ(packets[0].header.type, "VIDEO");
  EXPECT_TRUE(packets[0].skipped);
  EXPECT_EQ(packets[0].body, "");
  EXPECT_FALSE(packets[1].skipped);
  EXPECT_TRUE(packets[2].skipped);
  EXPECT_LT(most, 100u) << "a body that is skipped was kept";
}

TEST(StreamReader, KnownTypesThatAreNotWantedAreSkipped) {
  StreamReader reader({.wanted = {"STATUS"}});
  const std::string stream =
      encoded(envelope(), test_example::text()) + encoded(envelope(), StatusReport{});
  const auto packets = read_all(reader, stream, 10);
  ASSERT_EQ(packets.size(), 2u);
  EXPECT_TRUE(packets[0].skipped);
  EXPECT_FALSE(packets[1].skipped);
}

TEST(StreamReader, ASkippedBodyIsStillChecked) {
  std::string stream = framed("VIDEO", std::string(100, 'v'));
  stream.back() = 'w';
  StreamReader reader;
  EXPECT_EQ(error_of(reader, stream), "VIDEO of \"device\": the CRC-64 does not match the body");
}

TEST(StreamReader, ABodyAboveItsLimitIsRefusedByTheHeader) {
  const auto refused = [](const StreamLimits& limits, const std::string& type, std::uint64_t size) {
    StreamReader reader(limits);
    return error_of(reader, encode_header({1, type, "device", 0, size, 0}));
  };
  const StreamLimits limits{
      .wanted = {}, .body_bytes = 1000, .small_body_bytes = 100, .skipped_bytes = 10000};
  const std::pair<std::string, std::uint64_t> cases[] = {
      {"IMAGE", 1000}, {"POLYDATA", 1000}, {"POINT", 1000}, {"STATUS", 100},
      {"TDATA", 100},  {"STRING", 100},    {"VIDEO", 10000}};
  for (const auto& [type, limit] : cases) {
    EXPECT_EQ(refused(limits, type, limit), "") << type;
    EXPECT_EQ(refused(limits, type, limit + 1),
              type + " of \"device\": body of " + std::to_string(limit + 1) +
                  " bytes, must be at most " + std::to_string(limit));
    EXPECT_THAT(refused(limits, type, UINT64_MAX), HasSubstr("18446744073709551615 bytes"));
  }
  for (const auto& [name, content] : contents()) {
    EXPECT_THAT(refused({}, std::string(type_of(content)), std::uint64_t{1} << 40),
                HasSubstr("must be at most"));
  }
}

TEST(StreamReader, AHeaderTakesNoMemoryForTheBodyItPromises) {
  StreamReader reader;
  const std::string header = encode_header({1, "IMAGE", "device", 0, 64u << 20, 0});
  EXPECT_EQ(error_of(reader, header), "");
  EXPECT_LT(reader.held_bytes(), 100u);
  const std::string piece(10000, 'x');
  for (std::size_t received = piece.size(); received < 500000; received += piece.size()) {
    EXPECT_EQ(error_of(reader, piece), "");
    EXPECT_LE(reader.held_bytes(), 2 * received);
  }
}

TEST(StreamReader, AfterAnErrorEverythingIsRefusedWithIt) {
  StreamReader reader;
  const std::string good = encoded(envelope(), test_example::text());
  std::string bad = good;
  bad.back() = 'x';
  const std::string error = error_of(reader, good + bad);
  EXPECT_THAT(error, HasSubstr("CRC-64"));
  EXPECT_EQ(error_of(reader, good), error);
  EXPECT_LT(reader.held_bytes(), 100u);
}

TEST(StreamReader, WhatIsNotOpenIgtLinkIsRefused) {
  StreamReader reader;
  EXPECT_THAT(
      error_of(reader, "GET / HTTP/1.1\r\nHost: localhost:18945\r\nAccept: text/html\r\n\r\n"),
      HasSubstr("header version"));
}

// The longest STRING and STATUS with the most metadata that encode() lets through.
TEST(StreamReader, WhateverIsSentFitsTheDefaultLimits) {
  Envelope full = envelope(2);
  full.metadata.clear();
  for (int i = 0; i < 8191; ++i) full.metadata.push_back({std::to_string(10000 + i), "xy"});
  ASSERT_TRUE(validate(full.metadata));
  StreamReader reader;
  const std::string stream = encoded(full, Text{std::string(65535, 't')}) +
                             encoded(full, StatusReport{1, 0, "", std::string(65535, 't')});
  EXPECT_EQ(read_all(reader, stream, 4096).size(), 2u);
}

}  // namespace
}  // namespace brainshift::igtl
