// SPDX-License-Identifier: GPL-3.0-or-later
// What the tests and the library that they preload into a daemon (fault_shim.cpp) share: a file
// that both have mapped.
#pragma once

#include <atomic>

namespace brainshift::faults {

struct ShimControl {
  std::atomic<long> left;     // > 0: allocations from now up to the one that fails, once
  std::atomic<long> counted;  // allocations while `left` was above 0
  std::atomic<long> failed;
};

}  // namespace brainshift::faults
