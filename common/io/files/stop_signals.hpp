// SPDX-License-Identifier: GPL-3.0-or-later
// SIGINT, SIGTERM and SIGHUP (a terminal that closes) as a file descriptor, so that a poll loop
// sees them like any other event. A SIGHUP that was ignored before, as under nohup, stays ignored.
//
// By handlers, not by a blocked mask and signalfd: a library may start threads before main()
// (OpenBLAS does), which do not inherit a mask, and a signal to the process may be delivered to any
// of its threads.
#pragma once

#include <array>
#include <csignal>

#include "common/core/error.hpp"

namespace brainshift::io {

// A write to a pipe that nobody reads any more, or beyond the limit on a file's size, fails with
// EPIPE or EFBIG from here on; by default the signal that comes with it ends the process.
void survive_failing_writes();

class StopSignals {
 public:
  // From here on these signals only make fd() readable. One at a time in a process.
  static Result<StopSignals> catch_all();
  // The same for an event descriptor of the caller's, which outlives this.
  static Result<StopSignals> catch_into(int event_fd);
  StopSignals(StopSignals&& other) noexcept;
  StopSignals& operator=(StopSignals&&) = delete;
  ~StopSignals();  // restores the actions before

  int fd() const { return fd_; }  // readable once a signal has arrived
  bool arrived() const;

 private:
  StopSignals(int fd, bool own) : fd_(fd), own_(own) {}
  int fd_;
  bool own_;
  static constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kSignals.size()> before_ = {};  // their actions
};

}  // namespace brainshift::io
