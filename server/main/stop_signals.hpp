// SPDX-License-Identifier: GPL-3.0-or-later
// SIGINT and SIGTERM as a file descriptor, so that the poll loop sees them like any other event.
#pragma once

#include "common/core/error.hpp"

namespace brainshift::server {

class StopSignals {
 public:
  // Blocks both signals in the calling thread; make it before any other thread, which inherits the mask.
  static Result<StopSignals> block();
  StopSignals(StopSignals&& other) noexcept;
  StopSignals& operator=(StopSignals&&) = delete;
  ~StopSignals();

  int fd() const { return fd_; }  // readable once a signal has arrived

 private:
  explicit StopSignals(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace brainshift::server
