// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/memory.hpp"

#include <malloc.h>

namespace brainshift::server {
namespace {

// Above what an update allocates (an encoded field of 18 thousand nodes has 0.6 MiB), so that none
// costs page faults.
constexpr int kOwnPages = 4 << 20;
// What may stay free at the end of the heap. The default, once a threshold is fixed, is 128 KiB,
// and every update would give memory back and ask for it again.
constexpr int kKeptFree = 64 << 20;

}  // namespace

void return_large_blocks() {
  mallopt(M_MMAP_THRESHOLD, kOwnPages);
  mallopt(M_TRIM_THRESHOLD, kKeptFree);
}

}  // namespace brainshift::server
