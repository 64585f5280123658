// SPDX-License-Identifier: GPL-3.0-or-later
// brainshiftd health, as a container's health check runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <string>

#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"

namespace brainshift::integration {
namespace {

using testing::StartsWith;

constexpr const char* kHealthListening = "listening on ";

TEST(Health, IsZeroWhileTheDaemonAnswersAndOneAfterItHasGone) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  Background daemon({brainshiftd(), "serve", "--config", config}, files.path("log"));
  ASSERT_THAT(daemon.first_line(), StartsWith(kHealthListening));
  const std::string endpoint = daemon.first_line().substr(std::string(kHealthListening).size());
  const auto ask = [&] {
    return run({brainshiftd(), "health", "--config", config, "--endpoint", endpoint});
  };

  const Finished alive = ask();
  EXPECT_EQ(alive.exit_status, 0) << alive.err;
  EXPECT_THAT(alive.out, StartsWith("ok version="));
  EXPECT_THAT(alive.out, testing::HasSubstr("case=none"));

  EXPECT_EQ(daemon.end(SIGTERM), 0);
  const Finished gone = ask();
  EXPECT_EQ(gone.exit_status, 1);
  EXPECT_EQ(lines(gone.err).size(), 1u) << gone.err;
  EXPECT_EQ(gone.out, "");
}

TEST(Health, NeedsAPortThatIsKnown) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  const Finished asked = run({brainshiftd(), "health", "--config", config});
  EXPECT_EQ(asked.exit_status, 2);
  EXPECT_EQ(lines(asked.err).size(), 1u) << asked.err;
}

}  // namespace
}  // namespace brainshift::integration
