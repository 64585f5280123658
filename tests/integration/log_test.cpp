// SPDX-License-Identifier: GPL-3.0-or-later
// A daemon whose log nobody reads goes on serving, and ends when it is told to.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "client/lib/client.hpp"
#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"

namespace brainshift::integration {
namespace {

using testing::HasSubstr;

constexpr int kLimitMs = 20000;  // of silence

// A named pipe with a reader that reads nothing until it is asked to.
class StalledReader {
 public:
  explicit StalledReader(std::string path) : path_(std::move(path)) {
    if (mkfifo(path_.c_str(), 0600) != 0) throw std::runtime_error("mkfifo " + path_);
    // Open for writing as well: a daemon that opens the pipe need not wait for a reader.
    fd_ = open(path_.c_str(), O_RDWR | O_CLOEXEC);
    if (fd_ < 0) throw std::runtime_error("open " + path_);
  }
  ~StalledReader() { close(fd_); }
  StalledReader(const StalledReader&) = delete;
  StalledReader& operator=(const StalledReader&) = delete;
  const std::string& path() const { return path_; }
  int bytes() const { return fcntl(fd_, F_GETPIPE_SZ); }  // that the pipe holds
  std::string read_to(const std::string& text) {
    std::string read_so_far;
    std::array<char, 4096> buffer{};
    pollfd readable{fd_, POLLIN, 0};
    while (read_so_far.find(text) == std::string::npos && poll(&readable, 1, kLimitMs) == 1) {
      const ssize_t count = read(fd_, buffer.data(), buffer.size());
      if (count <= 0) break;
      read_so_far.append(buffer.data(), static_cast<std::size_t>(count));
    }
    return read_so_far;
  }

 private:
  std::string path_;
  int fd_ = -1;
};

class StalledLog : public testing::Test {
 protected:
  void SetUp() override {
    const auto config =
        files_.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\nlog_level: debug\n");
    daemon_ = std::make_unique<Background>(
        std::vector<std::string>{brainshiftd(), "serve", "--config", config}, reader_.path());
    const std::string listening = "listening on ";
    ASSERT_THAT(daemon_->first_line(), testing::StartsWith(listening));
    endpoint_ = daemon_->first_line().substr(listening.size());
  }

  // Frames that the daemon refuses, each with a reply and with a line of at least 60 bytes in its
  // log. A reply may get lost; a daemon that answers none of `kPatience` frames has stopped.
  bool send_malformed(int frames) {
    constexpr int kPatience = 10;
    zmq::context_t context;
    zmq::socket_t socket(context, zmq::socket_type::dealer);
    socket.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::rcvtimeo, 200);
    socket.connect(endpoint_);
    zmq::message_t reply;
    int unanswered = 0;
    for (int sent = 0; sent < frames && unanswered < kPatience; ++sent) {
      socket.send(zmq::str_buffer("not a frame"), zmq::send_flags::none);
      unanswered = socket.recv(reply) ? 0 : unanswered + 1;
    }
    return unanswered < kPatience;
  }

  void stall() {
    const int frames = reader_.bytes() / 60 + 3000;  // fills the pipe and the daemon's queue
    ASSERT_TRUE(send_malformed(frames)) << "the daemon waits for the reader of its log";
  }

  Workspace files_;
  StalledReader reader_{files_.path("log")};
  std::unique_ptr<Background> daemon_;
  std::string endpoint_;
};

TEST_F(StalledLog, StatusIsAnsweredAndTheLostLinesAreCountedOnceLinesFlowAgain) {
  ASSERT_NO_FATAL_FAILURE(stall());
  auto client = client::Client::connect(endpoint_);
  ASSERT_TRUE(client) << client.error().message;
  const auto status = client->status();
  EXPECT_TRUE(status) << status.error().message;
  EXPECT_THAT(reader_.read_to("lines of the log were lost"), HasSubstr("malformed frame"));
}

TEST_F(StalledLog, SigtermEndsTheDaemonWithStatusZero) {
  ASSERT_NO_FATAL_FAILURE(stall());
  EXPECT_EQ(daemon_->end(SIGTERM), 0);
}

}  // namespace
}  // namespace brainshift::integration
