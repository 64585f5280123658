// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/listener.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;

TEST(Listener, TellsThePortThatItTook) {
  for (const char* endpoint : {"tcp://127.0.0.1:*", "tcp://127.0.0.1:0", "tcp://lo:*"}) {
    const auto listener = value_or_fail(Listener::open(endpoint));
    EXPECT_THAT(listener.endpoint(), MatchesRegex("tcp://127\\.0\\.0\\.1:[1-9][0-9]+"));
  }
}

TEST(Listener, WhatIsNoEndpointIsRefusedByName) {
  for (const char* endpoint : {"", "nonsense", "ftp://127.0.0.1:1", "tcp://127.0.0.1", "tcp://:5",
                               "tcp://127.0.0.1:", "tcp://127.0.0.1:99999", "tcp://127.0.0.1:-1",
                               "tcp://127.0.0.1:80x", "ipc://"}) {
    EXPECT_THAT(refusal_of(Listener::open(endpoint), ErrorCode::kInvalidArgument),
                HasSubstr(endpoint));
  }
}

TEST(Listener, AnAddressThatIsNotHereIsUnavailable) {
  for (const char* endpoint : {"tcp://192.0.2.1:5555", "tcp://no-such-interface0:5555"}) {
    SCOPED_TRACE(endpoint);
    refusal_of(Listener::open(endpoint), ErrorCode::kUnavailable);
  }
}

TEST(Listener, TheSocketOfAnIpcPathGoesWithIt) {
  const test_support::TemporaryFolder folder;
  const auto path = folder / "s";
  {
    const auto listener = value_or_fail(Listener::open("ipc://" + path.string()));
    EXPECT_TRUE(std::filesystem::is_socket(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace brainshift::server
