// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/stop_signals.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <utility>

namespace brainshift::server {
namespace {

std::atomic<int> event_fd{-1};

void on_signal(int) {
  const int saved_errno = errno;
  const std::uint64_t one = 1;
  // A full counter cannot happen, and there is nobody to tell.
  [[maybe_unused]] const ssize_t written = write(event_fd.load(), &one, sizeof one);
  errno = saved_errno;
}

bool set_action(void (*action)(int)) {
  struct sigaction description {};
  description.sa_handler = action;
  description.sa_flags = SA_RESTART;
  sigemptyset(&description.sa_mask);
  return sigaction(SIGINT, &description, nullptr) == 0 &&
         sigaction(SIGTERM, &description, nullptr) == 0;
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
  event_fd = fd;
  StopSignals signals(fd);
  if (!set_action(on_signal)) {
    return fail(ErrorCode::kInternal, "SIGINT and SIGTERM cannot be handled");
  }
  return signals;
}

StopSignals::StopSignals(StopSignals&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

StopSignals::~StopSignals() {
  if (fd_ < 0) return;
  set_action(SIG_DFL);
  event_fd = -1;
  close(fd_);
}

}  // namespace brainshift::server
