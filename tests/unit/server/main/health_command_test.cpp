// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/health_command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace brainshift::server {
namespace {

TEST(EndpointToAsk, IsOnThisMachineWhereTheDaemonListensOnAllInterfaces) {
  EXPECT_EQ(*endpoint_to_ask("tcp://0.0.0.0:5555"), "tcp://127.0.0.1:5555");
  EXPECT_EQ(*endpoint_to_ask("tcp://*:5555"), "tcp://127.0.0.1:5555");
  EXPECT_EQ(*endpoint_to_ask("tcp://[::]:5555"), "tcp://[::1]:5555");
}

TEST(EndpointToAsk, IsTheDaemonsOwnOtherwise) {
  for (const char* endpoint :
       {"tcp://127.0.0.1:5555", "tcp://10.0.0.0:5555", "tcp://[::1]:80", "ipc:///run/a.sock"}) {
    EXPECT_EQ(*endpoint_to_ask(endpoint), endpoint);
  }
}

TEST(EndpointToAsk, NeedsAPortThatIsKnown) {
  const auto endpoint = endpoint_to_ask("tcp://127.0.0.1:*");
  ASSERT_FALSE(endpoint);
  EXPECT_EQ(endpoint.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(endpoint.error().message, testing::HasSubstr("tcp://127.0.0.1:*"));
}

}  // namespace
}  // namespace brainshift::server
