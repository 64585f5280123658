// SPDX-License-Identifier: GPL-3.0-or-later
// RAII round a POSIX file descriptor.
#pragma once

#include <unistd.h>

#include <utility>

namespace brainshift::io {

// Closes on scope exit; close() reports what a late write error says.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }
  bool close() {
    const int fd = std::exchange(fd_, -1);
    return fd < 0 || ::close(fd) == 0;
  }

 private:
  int fd_;
};

}  // namespace brainshift::io
