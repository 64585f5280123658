// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/line_queue.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <optional>
#include <string>
#include <thread>

namespace brainshift::client {
namespace {

using testing::EndsWith;
using testing::StartsWith;

class Pipe {
 public:
  Pipe() { EXPECT_EQ(::pipe(ends_), 0); }
  ~Pipe() {
    close_reader();
    close_writer();
  }
  int writer() const { return ends_[1]; }
  void close_reader() { close_end(ends_[0]); }
  void close_writer() { close_end(ends_[1]); }
  std::string rest() const {
    std::string all;
    char buffer[4096];
    for (ssize_t count = 0; (count = ::read(ends_[0], buffer, sizeof buffer)) > 0;) {
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }

 private:
  static void close_end(int& end) {
    if (end >= 0) ::close(end);
    end = -1;
  }
  int ends_[2] = {-1, -1};
};

TEST(LineQueue, WritesLinesInTheirOrder) {
  Pipe pipe;
  {
    LineQueue lines(pipe.writer());
    lines.tell("one");
    lines.tell("two");
  }
  pipe.close_writer();
  EXPECT_EQ(pipe.rest(), "one\ntwo\n");
}

TEST(LineQueue, WhatATerminalWouldObeyIsReplaced) {
  EXPECT_EQ(printable("a\x1b[2Jb\tc\x7f"), "a?[2Jb?c?");
  EXPECT_EQ(printable("a\xc2\x9b"
                      "2Jb \xe2\x80\xae"
                      "c \xe2\x81\xa6"),
            "a?2Jb ?c ?");
  EXPECT_EQ(printable("K\xc3\xb6ln \xe2\x80\x93 5 \xc2\xb5m"),
            "K\xc3\xb6ln \xe2\x80\x93 5 \xc2\xb5m");
}

// A paused pager, a full pipe: whoever tells goes on, and what is lost is counted once it is read.
TEST(LineQueue, AReaderThatStallsDelaysNobodyAndLearnsWhatItMissed) {
  Pipe pipe;
  std::optional<LineQueue> lines(std::in_place, pipe.writer());
  for (int i = 0; i < 5000; ++i) lines->tell(std::string(1000, 'x'));  // the pipe takes 64 KiB
  std::string read;
  std::thread reader([&] { read = pipe.rest(); });
  lines.reset();
  pipe.close_writer();
  reader.join();
  EXPECT_THAT(read, StartsWith("xxx"));
  EXPECT_THAT(read, EndsWith(" lines were not printed: the output was not read\n"));
}

TEST(LineQueue, EndsAlthoughNobodyReads) {
  Pipe pipe;
  LineQueue lines(pipe.writer());
  for (int i = 0; i < 5000; ++i) lines.tell(std::string(1000, 'x'));
}

TEST(LineQueue, WithoutAReaderNothingEnds) {
  std::signal(SIGPIPE, SIG_IGN);
  Pipe pipe;
  pipe.close_reader();
  LineQueue lines(pipe.writer());
  for (int i = 0; i < 5000; ++i) lines.tell("nobody hears it");
}

}  // namespace
}  // namespace brainshift::client
