// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/exit_status.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace brainshift::server {

namespace {

// A daemon that fails must end, also when nobody reads its stderr.
constexpr int kReaderLimitMs = 500;

}  // namespace

int print_error(const Error& error) {
  std::string line = error.message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  pollfd writable{STDERR_FILENO, POLLOUT, 0};
  if (poll(&writable, 1, kReaderLimitMs) != 0) {
    std::fprintf(stderr, "brainshiftd: %s\n", line.c_str());
  }
  return exit_status(error.code);
}

}  // namespace brainshift::server
