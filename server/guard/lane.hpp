// SPDX-License-Identifier: GPL-3.0-or-later
// Lane: bytes on their way in one direction, from one socket that does not block to another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brainshift::server {

struct Lane {
  static constexpr std::size_t kBytes = 16u << 10;

  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(kBytes);
  std::size_t begin = 0;
  std::size_t end = 0;
  bool empty() const { return begin == end; }
};

// Writes out what the lane holds, as far as the socket takes it; once it is empty, and if `more`,
// reads into it. The bytes that came; 0: it cannot go on now, -1: an end has gone.
int pass_on(Lane& lane, int from, int to, bool more);

}  // namespace brainshift::server
