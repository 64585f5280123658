// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/zmtp_stream.hpp"

#include <gmock/gmock.h>

#include <random>
#include <string>

namespace brainshift::server {
namespace {

using testing::HasSubstr;

constexpr char kMore = 1;

std::string greeting(const std::string& mechanism) {
  std::string bytes(64, '\0');
  bytes[0] = '\xff';
  bytes[9] = '\x7f';
  bytes[10] = 3;
  return bytes.replace(12, mechanism.size(), mechanism);
}

std::string frame(char flags, const std::string& body) {
  return std::string{flags, static_cast<char>(body.size())} + body;
}

std::string long_head(char flags, std::uint64_t size) {
  std::string bytes(1, static_cast<char>(flags | 2));
  for (int shift = 56; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(size >> shift));
  return bytes;
}

std::string ready(const std::string& routing_id) {
  std::string body = "\5READY";
  body += std::string("\x0bSocket-Type") + std::string("\0\0\0\6", 4) + "DEALER";
  body += std::string("\x08Identity") + std::string("\0\0\0", 3) +
          static_cast<char>(routing_id.size()) + routing_id;
  return frame(4, body);
}

std::string take(ZmtpStream& stream, const std::string& bytes) {
  return stream.take({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

TEST(ZmtpStream, CountsWhatMessagesCostAndNoCommands) {
  ZmtpStream stream({});
  EXPECT_EQ(take(stream, greeting("NULL") + ready("")), "");
  EXPECT_EQ(stream.cost(), 0u);
  EXPECT_FALSE(stream.encrypted());
  EXPECT_EQ(take(stream, frame(0, "hello")), "");
  EXPECT_EQ(stream.cost(), ZmtpStream::kPartCost + 2 + 5);
  EXPECT_EQ(take(stream, long_head(0, 1000)), "");
  EXPECT_EQ(stream.cost(), 2 * ZmtpStream::kPartCost + 2 + 5 + 9) << "the body has not come";
  EXPECT_EQ(take(stream, std::string(1000, 'x')), "");
  EXPECT_EQ(stream.cost(), 2 * ZmtpStream::kPartCost + 2 + 5 + 9 + 1000);
  EXPECT_EQ(take(stream, frame(4, "\4PING")), "");
}

TEST(ZmtpStream, PiecesMakeNoDifference) {
  const std::string bytes = greeting("CURVE") + ready("x") + frame(kMore, "a") + frame(0, "") +
                            long_head(0, 300) + std::string(300, 'y') + frame(0, "end");
  ZmtpStream whole({});
  EXPECT_EQ(take(whole, bytes), "");
  ZmtpStream pieces({});
  std::mt19937 random(1);
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = 1 + random() % 7;
    EXPECT_EQ(take(pieces, bytes.substr(at, size)), "");
    at += size;
  }
  EXPECT_EQ(whole.cost(), pieces.cost());
  EXPECT_TRUE(whole.encrypted());
  EXPECT_EQ(whole.routing_id(), "") << "with CURVE the first command is no READY";
}

TEST(ZmtpStream, TellsTheRoutingIdThatAPeerChose) {
  ZmtpStream stream({});
  EXPECT_EQ(take(stream, greeting("NULL") + ready("mine")), "");
  EXPECT_EQ(stream.routing_id(), "mine");
  ZmtpStream none({});
  EXPECT_EQ(take(none, greeting("NULL") + ready("")), "");
  EXPECT_EQ(none.routing_id(), "");
}

TEST(ZmtpStream, TheBoundsHoldAtTheirEdges) {
  const ZmtpStream::Bounds bounds{.message_bytes = 1000, .parts = 3, .command_bytes = 100};
  const auto begun = [&] {
    ZmtpStream stream(bounds);
    EXPECT_EQ(take(stream, greeting("NULL") + ready("")), "");
    return stream;
  };
  ZmtpStream good = begun();
  for (int i = 0; i < 10; ++i) {  // every message counts for itself
    EXPECT_EQ(take(good, frame(kMore, "") + frame(kMore, "") + frame(0, "")), "");
    EXPECT_EQ(take(good, long_head(0, 1000) + std::string(1000, 'x')), "");
  }
  ZmtpStream parts = begun();
  EXPECT_EQ(take(parts, frame(kMore, "") + frame(kMore, "") + frame(kMore, "")), "");
  EXPECT_THAT(take(parts, frame(kMore, "")), HasSubstr("more than 3 parts"));
  ZmtpStream large = begun();
  EXPECT_THAT(take(large, long_head(0, 1001)), HasSubstr("more than 1000 bytes"));
  ZmtpStream sum = begun();
  EXPECT_EQ(take(sum, long_head(kMore, 900) + std::string(900, 'x')), "");
  EXPECT_THAT(take(sum, frame(0, std::string(101, 'x'))), HasSubstr("more than 1000 bytes"));
  ZmtpStream huge = begun();
  EXPECT_THAT(take(huge, long_head(0, ~0ull)), HasSubstr("more than 1000 bytes"));
  ZmtpStream command = begun();
  EXPECT_THAT(take(command, long_head(4, 101)), HasSubstr("a command of 101 bytes"));
}

TEST(ZmtpStream, WhatIsNoZmtpIsRefused) {
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\n\r\n"), std::string(1, '\0'), std::string(64, '\xff')}) {
    ZmtpStream stream({});
    EXPECT_THAT(take(stream, bytes), HasSubstr("ZMTP"));
  }
  std::string old = greeting("NULL");
  old[10] = 1;
  ZmtpStream version({});
  EXPECT_THAT(take(version, old), HasSubstr("below 3"));
  ZmtpStream flags({});
  EXPECT_THAT(take(flags, greeting("NULL") + frame(8, "")), HasSubstr("no ZMTP frame"));
  ZmtpStream both({});
  EXPECT_THAT(take(both, greeting("NULL") + frame(5, "")), HasSubstr("no ZMTP frame"));
}

TEST(ZmtpStream, AnyBytesAfterTheGreetingAreFollowedOrRefused) {
  std::mt19937 random(7);
  for (int round = 0; round < 2000; ++round) {
    ZmtpStream stream({.message_bytes = 500, .parts = 4, .command_bytes = 50});
    EXPECT_EQ(take(stream, greeting("NULL")), "");
    std::string bytes(200, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random() % 8 == 0 ? random() : random() % 3);
    static_cast<void>(take(stream, bytes));
    EXPECT_LE(stream.cost(), bytes.size() * (1 + ZmtpStream::kPartCost));
  }
}

}  // namespace
}  // namespace brainshift::server
