// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/connection.hpp"

#include <sys/un.h>
#include <unistd.h>

#include <algorithm>

namespace brainshift::server {
namespace {

// Two heartbeats a second with CURVE, which nobody sees delivered: 45 bytes and the part's cost.
constexpr double kForgivenPerSecond = 512.0;
constexpr std::uint64_t kHeartbeat = 128;

}  // namespace

Connection::~Connection() {
  if (peer >= 0) ::close(peer);
  if (inner >= 0) ::close(inner);
}

std::uint64_t Connection::settle(TimePoint now) {
  const std::uint64_t before = held;
  const std::uint64_t cost = stream.cost();
  const std::uint64_t delivered = account->delivered;
  const std::uint64_t messages = account->messages;
  const std::uint64_t parts = account->parts;
  std::uint64_t less = delivered - delivered_;
  std::uint64_t fewer = messages - messages_;
  if (stream.encrypted()) {
    const double seconds = std::chrono::duration<double>(now - forgiven).count();
    const auto some = static_cast<std::uint64_t>(kForgivenPerSecond * seconds);
    if (some > 0) forgiven = now;
    less += some;
    forgiven_bytes_ += some;
    fewer = parts - parts_ + forgiven_bytes_ / kHeartbeat;
    forgiven_bytes_ %= kHeartbeat;
  }
  held += cost - cost_;
  held -= std::min(held, less);
  waiting += stream.messages() - complete_;
  waiting -= std::min(waiting, fewer);
  if (messages != messages_ || held == 0) moved = now;
  cost_ = cost;
  complete_ = stream.messages();
  parts_ = parts;
  delivered_ = delivered;
  messages_ = messages;
  return held - before;
}

std::string socket_name(int fd, decltype(&getsockname) ask) {
  sockaddr_un address{};
  socklen_t size = sizeof address;
  if (ask(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  if (size <= offsetof(sockaddr_un, sun_path)) return {};
  return {address.sun_path, size - offsetof(sockaddr_un, sun_path)};
}

int connect_inner(const std::string& inner) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  sockaddr_un own{};
  own.sun_family = AF_UNIX;
  sockaddr_un other{};
  other.sun_family = AF_UNIX;
  inner.copy(other.sun_path + 1, sizeof other.sun_path - 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + inner.size());
  if (bind(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own.sun_family) == 0 &&
      connect(fd, reinterpret_cast<const sockaddr*>(&other), size) == 0) {
    return fd;
  }
  ::close(fd);
  return -1;
}

}  // namespace brainshift::server
