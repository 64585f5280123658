// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/lane.hpp"

#include <sys/socket.h>

#include <cerrno>

namespace brainshift::server {

int pass_on(Lane& lane, int from, int to, bool more) {
  while (!lane.empty()) {
    const auto sent = send(to, lane.bytes.data() + lane.begin, lane.end - lane.begin, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return errno == EAGAIN ? 0 : -1;
    lane.begin += static_cast<std::size_t>(sent);
  }
  lane.begin = lane.end = 0;
  if (!more) return 0;
  const auto got = recv(from, lane.bytes.data(), lane.bytes.size(), 0);
  if (got < 0) return errno == EAGAIN || errno == EINTR ? 0 : -1;
  if (got == 0) return -1;
  lane.end = static_cast<std::size_t>(got);
  return static_cast<int>(got);
}

}  // namespace brainshift::server
