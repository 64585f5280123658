// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/faults/tcp_proxy.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <deque>
#include <system_error>

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Bytes on their way in one direction, each chunk with the time from which it may go on.
struct Lane {
  static constexpr std::size_t kMaxChunks = 64;
  struct Chunk {
    Clock::time_point due;
    std::string bytes;
  };
  std::deque<Chunk> chunks;

  // False when the sender has closed.
  bool take(int from, std::chrono::milliseconds delay) {
    std::array<char, 65536> buffer;
    while (chunks.size() < kMaxChunks) {
      const ssize_t count = recv(from, buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (count == 0) return false;
      if (count < 0) return errno == EAGAIN || errno == EINTR;
      chunks.push_back(
          {Clock::now() + delay, std::string(buffer.data(), static_cast<std::size_t>(count))});
    }
    return true;
  }
  bool give(int to) {
    while (!chunks.empty() && chunks.front().due <= Clock::now()) {
      std::string& bytes = chunks.front().bytes;
      const ssize_t count = send(to, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (count < 0) return errno == EAGAIN || errno == EINTR;
      bytes.erase(0, static_cast<std::size_t>(count));
      if (bytes.empty()) chunks.pop_front();
    }
    return true;
  }
};

}  // namespace

struct TcpProxy::Pair {
  int client = -1;
  int daemon = -1;
  Lane up, down;

  ~Pair() {
    close(client);
    close(daemon);
  }
  bool forward(std::chrono::milliseconds delay) {
    return up.take(client, delay) && down.take(daemon, delay) && up.give(daemon) &&
           down.give(client);
  }
};

TcpProxy::TcpProxy(std::uint16_t target)
    : target_(target), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  auto* bytes = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, bytes, size) != 0 || listen(listener_, 128) != 0 ||
      getsockname(listener_, bytes, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "proxy");
  }
  endpoint_ = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

TcpProxy::~TcpProxy() {
  thread_.request_stop();
  thread_.join();
  close(listener_);
}

void TcpProxy::stall(bool stalled) {
  stalled_ = stalled;
  while (passes_ == stalled) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void TcpProxy::accept_one() {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  auto pair = std::make_unique<Pair>();
  pair->client = client;
  pair->daemon = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(target_);
  if (connect(pair->daemon, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    pairs_.push_back(std::move(pair));
  }
}

void TcpProxy::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::vector<pollfd> watched = {{listener_, POLLIN, 0}};
    const bool passes = !stalled_;
    passes_ = passes;
    for (const auto& pair : pairs_) {
      if (!passes) break;
      watched.push_back({pair->client, POLLIN, 0});
      watched.push_back({pair->daemon, POLLIN, 0});
    }
    // Chunks that wait for their time, or for room, are looked at every millisecond.
    poll(watched.data(), watched.size(), 1);
    if (cut_.exchange(false)) pairs_.clear();
    if ((watched[0].revents & POLLIN) != 0) accept_one();
    if (!passes) continue;
    const std::chrono::milliseconds delay(delay_ms_.load());
    std::erase_if(pairs_, [&](const auto& pair) { return !pair->forward(delay); });
  }
}

}  // namespace brainshift::faults
