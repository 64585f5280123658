// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/stop_signals.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

namespace brainshift::io {
namespace {

std::atomic<int> event_fd{-1};

void on_signal(int) {
  const int saved_errno = errno;
  const std::uint64_t one = 1;
  // A full counter cannot happen, and there is nobody to tell.
  [[maybe_unused]] const ssize_t written = write(event_fd.load(), &one, sizeof one);
  errno = saved_errno;
}

}  // namespace

void survive_failing_writes() {
  for (const int signal : {SIGPIPE, SIGXFSZ}) {
    struct sigaction description {};
    description.sa_handler = SIG_IGN;
    sigemptyset(&description.sa_mask);
    sigaction(signal, &description, nullptr);
  }
}

Result<StopSignals> StopSignals::catch_all() {
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (fd < 0) return fail(ErrorCode::kInternal, std::string("eventfd: ") + std::strerror(errno));
  auto signals = catch_into(fd);
  if (signals) {
    signals->own_ = true;
  } else {
    close(fd);
  }
  return signals;
}

Result<StopSignals> StopSignals::catch_into(int fd) {
  event_fd = fd;
  StopSignals signals(fd, false);
  struct sigaction description {};
  description.sa_handler = on_signal;
  description.sa_flags = SA_RESTART;
  sigemptyset(&description.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction& before = signals.before_[i];
    if (sigaction(kSignals[i], &description, &before) != 0) {
      return fail(ErrorCode::kInternal, "SIGINT, SIGTERM and SIGHUP cannot be handled");
    }
    if (kSignals[i] == SIGHUP && before.sa_handler == SIG_IGN) sigaction(SIGHUP, &before, nullptr);
  }
  return signals;
}

StopSignals::StopSignals(StopSignals&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), own_(other.own_), before_(other.before_) {}

StopSignals::~StopSignals() {
  if (fd_ < 0) return;
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
  event_fd = -1;
  if (own_) close(fd_);
}

bool StopSignals::arrived() const {
  pollfd item{fd_, POLLIN, 0};
  return poll(&item, 1, 0) > 0;
}

}  // namespace brainshift::io
