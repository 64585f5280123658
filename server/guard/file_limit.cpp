// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/file_limit.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <limits>

namespace brainshift::server {
namespace {

constexpr long kMostConnections = 1024;

}  // namespace

long raise_file_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1024;
  rlimit raised = limit;
  raised.rlim_cur = limit.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  constexpr auto kLargest = static_cast<rlim_t>(std::numeric_limits<long>::max());
  return static_cast<long>(std::min(limit.rlim_cur, kLargest));
}

int connections_within(long file_limit) {
  return static_cast<int>(
      std::clamp((file_limit - kReservedFiles) / kFilesPerConnection, 1L, kMostConnections));
}

}  // namespace brainshift::server
