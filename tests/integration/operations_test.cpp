// SPDX-License-Identifier: GPL-3.0-or-later
// What a running daemon tells systemd, a person and a monitor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"

namespace brainshift::integration {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

std::string endpoint_of(const Background& daemon) {
  const std::string listening = "listening on ";
  EXPECT_THAT(daemon.first_line(), StartsWith(listening));
  return daemon.first_line().substr(listening.size());
}

// A datagram socket in the place of systemd's.
class Notify : public testing::Test {
 protected:
  Notify() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = files_.path("notify");
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    setenv("WATCHDOG_USEC", "600000", 1);
  }
  ~Notify() override {
    close(fd_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }
  // Hears until one begins with `last`, for at most 10 s of silence.
  std::vector<std::string> hear_to(const std::string& last) const {
    std::vector<std::string> words;
    std::array<char, 512> buffer{};
    pollfd readable{fd_, POLLIN, 0};
    while ((words.empty() || words.back().rfind(last, 0) != 0) && poll(&readable, 1, 10'000) == 1) {
      const ssize_t size = recv(fd_, buffer.data(), buffer.size(), 0);
      if (size < 0) break;
      words.emplace_back(buffer.data(), static_cast<std::size_t>(size));
    }
    EXPECT_THAT(words, Contains(StartsWith(last)));
    return words;
  }

  Workspace files_;
  int fd_ = -1;
};

TEST_F(Notify, ReadyIsSaidOnceClientsCanConnectAndStoppingAtTheEnd) {
  const auto config = files_.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  Background daemon({brainshiftd(), "serve", "--config", config}, files_.path("log"));
  EXPECT_EQ(hear_to("READY=1").front(), "READY=1") << "nothing before it";
  EXPECT_THAT(daemon.first_line(), StartsWith("listening on "));
  EXPECT_THAT(hear_to("STATUS="), Contains("STATUS=empty"));
  // It lives although nobody asks it anything.
  for (int i = 0; i < 4; ++i) hear_to("WATCHDOG=1");
  EXPECT_EQ(daemon.end(SIGTERM), 0);
  const auto last = hear_to("STOPPING=1");
  EXPECT_THAT(last, testing::Not(Contains("READY=1")));
}

TEST_F(Notify, AStoppedProcessIsSilent) {
  const auto config = files_.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  Background daemon({brainshiftd(), "serve", "--config", config}, files_.path("log"));
  hear_to("WATCHDOG=1");
  EXPECT_EQ(daemon.end(SIGTERM), 0);
  hear_to("STOPPING=1");
  pollfd readable{fd_, POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, 0), 0);
}

TEST(OperationsCommands, StatusOfADaemonWithoutAModelIsAPageAndAReason) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  const Background daemon({brainshiftd(), "serve", "--config", config}, files.path("log"));
  const std::string endpoint = endpoint_of(daemon);
  const Finished text = run({brainshift(), "status", "--endpoint", endpoint}, 30.0);
  EXPECT_EQ(text.exit_status, 1);
  EXPECT_THAT(text.out, HasSubstr("ATTENTION: no model is loaded"));
  EXPECT_THAT(text.out, HasSubstr("1 connected"));
  EXPECT_EQ(text.err, "brainshift: " + endpoint + ": no model is loaded\n");
  const Finished json = run({brainshift(), "status", "--json", "--endpoint", endpoint}, 30.0);
  EXPECT_EQ(json.exit_status, 1);
  const auto read = nlohmann::json::parse(json.out);
  EXPECT_EQ(read["well"], false);
  EXPECT_EQ(read["session"]["phase"], "empty");
  EXPECT_GT(read["process"]["resident_bytes"], 1 << 20);
  const Finished once =
      run({brainshift(), "top", "--once", "--interval", "0.1", "--endpoint", endpoint}, 30.0);
  EXPECT_EQ(once.exit_status, 0) << once.err;
  EXPECT_THAT(once.out, HasSubstr("0.0/s"));
}

TEST(MetricsEndpoint, APortThatIsTakenStopsTheStartInOneLine) {
  const Workspace files;
  const auto first_config = files.write(
      "first.yaml", "endpoint: tcp://127.0.0.1:*\nmetrics: {endpoint: '127.0.0.1:0'}\n");
  const Background first({brainshiftd(), "serve", "--config", first_config}, files.path("log"));
  const std::string endpoint = endpoint_of(first);
  const std::string port = endpoint.substr(endpoint.rfind(':') + 1);  // somebody listens there
  const auto config = files.write("second.yaml",
                                  "endpoint: tcp://127.0.0.1:*\nmetrics: {endpoint: "
                                  "'127.0.0.1:" +
                                      port + "'}\nlog_level: error\n");
  const Finished second = run({brainshiftd(), "serve", "--config", config}, 30.0);
  EXPECT_EQ(second.exit_status, 2);
  EXPECT_THAT(second.err, HasSubstr("metrics.endpoint = 127.0.0.1:" + port));
  EXPECT_EQ(std::count(second.err.begin(), second.err.end(), '\n'), 1) << second.err;
}

}  // namespace
}  // namespace brainshift::integration
