// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/process_limits.hpp"

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <limits>

namespace brainshift::server {
namespace {

constexpr long kMaxConnections = 1024;
// Above what an update allocates (an encoded field of 18 thousand nodes has 0.6 MiB), so that none
// costs page faults.
constexpr int kOwnPages = 4 << 20;
// What may stay free at the end of the heap. The default, once a threshold is fixed, is 128 KiB,
// and every update would give memory back and ask for it again.
constexpr int kKeptFree = 64 << 20;

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
      std::clamp((file_limit - kReservedFiles) / kFilesPerConnection, 1L, kMaxConnections));
}

void return_large_blocks() {
  mallopt(M_MMAP_THRESHOLD, kOwnPages);
  mallopt(M_TRIM_THRESHOLD, kKeptFree);
}

}  // namespace brainshift::server
