// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/address.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace brainshift::client {
namespace {

TEST(Address, ReadsWhatItWrites) {
  for (const char* text : {"127.0.0.1:18945", "[::1]:18945", "slicer.local:1", "0.0.0.0:65535"}) {
    const auto address = parse_address("--listen", text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(to_string(*address), text);
  }
  EXPECT_EQ(parse_address("--listen", ":18945").value(), (Address{"127.0.0.1", 18945}))
      << "without an address: this computer alone";
  EXPECT_EQ(parse_address("--listen", "[::1]:0").value(), (Address{"::1", 0}));
}

TEST(Address, RefusesWhatIsUnclear) {
  for (const char* text :
       {"", "18945", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536", "127.0.0.1:-1",
        "127.0.0.1:80 ", "::1:18945", "[::1]", "[]:1", "a b:1", "http://a:1", "a:1:2"}) {
    const auto address = parse_address("--listen", text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(address.error().message,
                testing::StartsWith("--listen " + std::string(text) + ": must be ADDRESS:PORT"));
  }
}

TEST(Address, KnowsWhatStaysInThisComputer) {
  EXPECT_TRUE(is_loopback({"127.0.0.1", 1}));
  EXPECT_TRUE(is_loopback({"127.1.2.3", 1}));
  EXPECT_TRUE(is_loopback({"::1", 1}));
  EXPECT_TRUE(is_loopback({"localhost", 1}));
  EXPECT_FALSE(is_loopback({"0.0.0.0", 1}));
  EXPECT_FALSE(is_loopback({"::", 1}));
  EXPECT_FALSE(is_loopback({"192.168.0.7", 1}));
}

}  // namespace
}  // namespace brainshift::client
