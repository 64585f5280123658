// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/stop_signals.hpp"
#include "tests/support/results.hpp"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <csignal>

namespace brainshift::io {
namespace {

// Each ends the process by default: a dead reader of the log, a limit on the journal's size.
TEST(FailingWrites, DoNotEndTheProcess) {
  survive_failing_writes();
  EXPECT_EQ(std::raise(SIGPIPE), 0);
  EXPECT_EQ(std::raise(SIGXFSZ), 0);
}

TEST(StopSignals, BecomeReadableInsteadOfEndingTheProcess) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const auto signals = value_or_fail(StopSignals::catch_all());
    EXPECT_FALSE(signals.arrived());
    std::raise(signal);
    EXPECT_TRUE(signals.arrived()) << signal;
  }
}

TEST(StopSignals, UnderNohupATerminalThatClosesStopsNothing) {
  std::signal(SIGHUP, SIG_IGN);
  {
    const auto signals = value_or_fail(StopSignals::catch_all());
    std::raise(SIGHUP);
    EXPECT_FALSE(signals.arrived());
  }
  EXPECT_EQ(std::signal(SIGHUP, SIG_DFL), SIG_IGN);
}

TEST(StopSignals, WriteToAnotherDescriptorAndRestoreWhatWasThere) {
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  const auto handler = +[](int) {};
  std::signal(SIGINT, handler);
  {
    const auto signals = value_or_fail(StopSignals::catch_into(fd));
    std::raise(SIGINT);
    EXPECT_TRUE(signals.arrived());
  }
  EXPECT_EQ(std::signal(SIGINT, SIG_DFL), handler);
  EXPECT_EQ(close(fd), 0) << "it is the caller's";
}

}  // namespace
}  // namespace brainshift::io
