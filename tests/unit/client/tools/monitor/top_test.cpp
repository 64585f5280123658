// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift top` on a terminal of the test, and on a pipe.
#include "client/tools/monitor/top.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <future>
#include <string>

#include "tests/support/results.hpp"
#include "tests/unit/client/lib/fake_daemon.hpp"
#include "tests/unit/client/tools/monitor/sample_report.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;

class TopTest : public testing::Test {
 protected:
  static FakeDaemon::Handler answering(std::atomic<int>& asked) {
    return [&asked](const wire::Frame& request) {
      wire::DaemonReport report = sample_report();
      report.uptime_ms += 100u * static_cast<unsigned>(++asked);
      report.usable += 3u * static_cast<unsigned>(asked);
      return FakeDaemon::Answers{wire::encode_frame(wire::MessageType::kReportReply,
                                                    request.request_id, wire::encode(report))};
    };
  }
  // What comes from fd until it holds `text`; for at most 10 s of silence.
  static std::string read_to(int fd, const std::string& text) {
    std::string got;
    std::array<char, 4096> buffer{};
    pollfd readable{fd, POLLIN, 0};
    while (got.find(text) == std::string::npos && poll(&readable, 1, 10'000) == 1) {
      const ssize_t size = read(fd, buffer.data(), buffer.size());
      if (size <= 0) break;
      got.append(buffer.data(), static_cast<std::size_t>(size));
    }
    EXPECT_THAT(got, HasSubstr(text));
    return got;
  }
  static TopOptions options_for(const FakeDaemon& daemon) {
    TopOptions options;
    options.endpoint = daemon.endpoint();
    options.interval = std::chrono::milliseconds(100);
    return options;
  }

  std::atomic<int> asked_ = 0;
};

class Terminal {
 public:
  Terminal() {
    winsize size{};
    size.ws_row = 30;
    size.ws_col = 60;
    if (openpty(&master, &slave, nullptr, nullptr, &size) != 0) throw std::runtime_error("openpty");
  }
  ~Terminal() {
    close(master);
    close(slave);
  }
  bool echoes() const {
    termios modes{};
    tcgetattr(slave, &modes);
    return (modes.c_lflag & ECHO) != 0;
  }
  int master = -1;
  int slave = -1;
};

TEST_F(TopTest, DrawsInPlaceUntilQAndLeavesTheTerminalAsItWas) {
  const FakeDaemon daemon(answering(asked_));
  const Terminal terminal;
  TopOptions options = options_for(daemon);
  options.input = options.output = terminal.slave;
  auto ended = std::async(std::launch::async, [&] { return top(options); });
  const std::string begun = read_to(terminal.master, "verdict   well");
  EXPECT_THAT(begun, HasSubstr("\033[?1049h"));
  EXPECT_THAT(read_to(terminal.master, "/s"), HasSubstr("\033[H")) << "again, with rates";
  EXPECT_FALSE(terminal.echoes());
  EXPECT_THAT(begun, Not(HasSubstr("\033[1;31m"))) << "nothing alarms";
  ASSERT_EQ(write(terminal.master, "q", 1), 1);
  read_to(terminal.master, "\033[?1049l");
  EXPECT_TRUE(ended.get().has_value());
  EXPECT_TRUE(terminal.echoes());
}

TEST_F(TopTest, LinesAreCutToTheTerminal) {
  const FakeDaemon daemon(answering(asked_));
  const Terminal terminal;
  TopOptions options = options_for(daemon);
  options.input = options.output = terminal.slave;
  auto ended = std::async(std::launch::async, [&] { return top(options); });
  const std::string drawn = read_to(terminal.master, "\033[J");
  ASSERT_EQ(write(terminal.master, "q", 1), 1);
  EXPECT_TRUE(ended.get().has_value());
  std::istringstream lines(drawn.substr(drawn.find("\033[H") + 3));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end = line.find("\033[K");
    EXPECT_LE(std::min(end, line.size()), 60u) << line;
  }
}

TEST_F(TopTest, SigintEndsItCleanly) {
  const FakeDaemon daemon(answering(asked_));
  const Terminal terminal;
  TopOptions options = options_for(daemon);
  options.input = options.output = terminal.slave;
  auto ended = std::async(std::launch::async, [&] { return top(options); });
  read_to(terminal.master, "verdict");
  ASSERT_EQ(kill(getpid(), SIGINT), 0);
  read_to(terminal.master, "\033[?1049l");
  EXPECT_TRUE(ended.get().has_value());
  EXPECT_TRUE(terminal.echoes());
}

TEST_F(TopTest, OnAPipeEveryLookIsALine) {
  const FakeDaemon daemon(answering(asked_));
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  TopOptions options = options_for(daemon);
  options.output = ends[1];
  auto ended = std::async(std::launch::async, [&] { return top(options); });
  const std::string lines = read_to(ends[0], "updates/s");
  EXPECT_THAT(lines, HasSubstr("tracking, field 0.2 s old"));
  EXPECT_THAT(lines, Not(HasSubstr("\033")));
  ASSERT_EQ(kill(getpid(), SIGTERM), 0);
  EXPECT_TRUE(ended.get().has_value());
  for (const int fd : ends) close(fd);
}

TEST_F(TopTest, OnceIsAPageWithTheRatesOfOneInterval) {
  const FakeDaemon daemon(answering(asked_));
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  TopOptions options = options_for(daemon);
  options.output = ends[1];
  options.once = true;
  ASSERT_TRUE(top(options));
  close(ends[1]);
  const std::string text = read_to(ends[0], "descriptors");
  EXPECT_THAT(text, HasSubstr("30.0/s")) << "3 updates in 0.1 s of the daemon";
  EXPECT_EQ(asked_, 2);
  close(ends[0]);
}

TEST_F(TopTest, ADaemonThatNoLongerAnswersIsCalledStale) {
  auto daemon = std::make_unique<FakeDaemon>(answering(asked_));
  const Terminal terminal;
  TopOptions options = options_for(*daemon);
  options.input = options.output = terminal.slave;
  auto ended = std::async(std::launch::async, [&] { return top(options); });
  read_to(terminal.master, "verdict   well");
  daemon.reset();
  const std::string after = read_to(terminal.master, "STALE: no answer for");
  EXPECT_THAT(after, HasSubstr("\033[1;31mSTALE")) << "in red as well";
  read_to(terminal.master, "session 3");  // the last page stays
  ASSERT_EQ(write(terminal.master, "q", 1), 1);
  EXPECT_TRUE(ended.get().has_value());
}

TEST_F(TopTest, WithoutADaemonOnceFails) {
  std::string endpoint;
  {
    const FakeDaemon daemon(answering(asked_));
    endpoint = daemon.endpoint();
  }
  TopOptions options;
  options.endpoint = endpoint;
  options.once = true;
  refusal_of(top(options), ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace brainshift::client
