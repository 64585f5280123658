// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/zmtp_peer.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <utility>

namespace brainshift::test_support {
namespace {

constexpr int kPatience_ms = 5000;
constexpr char kMore = 1, kLong = 2, kCommand = 4;  // bits of a part's first byte

std::string big_endian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 0xff);
  return text;
}

std::string greeting() {
  std::string text = "\xff" + std::string(8, '\0') + "\x7f" + std::string("\3\0", 2) + "NULL";
  text.resize(64, '\0');
  return text;
}

std::string ready_command() {
  const std::string type = "DEALER";
  const std::string body =
      std::string("\5READY") + "\13" + "Socket-Type" + big_endian(type.size(), 4) + type;
  return std::string(1, kCommand) + static_cast<char>(body.size()) + body;
}

}  // namespace

std::uint16_t port_of(const std::string& endpoint) {
  const std::size_t colon = endpoint.rfind(':');
  if (endpoint.rfind("tcp://127.0.0.1:", 0) != 0) {
    throw std::runtime_error(endpoint + ": must be tcp on 127.0.0.1");
  }
  return static_cast<std::uint16_t>(std::stoi(endpoint.substr(colon + 1)));
}

ZmtpPeer::ZmtpPeer(std::uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd_ < 0) return;
  if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
  close(fd_);
  fd_ = -1;
}

ZmtpPeer::~ZmtpPeer() {
  if (fd_ >= 0) close(fd_);
}

ZmtpPeer::ZmtpPeer(ZmtpPeer&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

ZmtpPeer& ZmtpPeer::operator=(ZmtpPeer&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

bool ZmtpPeer::send_bytes(std::string_view bytes) {
  while (!bytes.empty()) {
    pollfd writable{fd_, POLLOUT, 0};
    if (fd_ < 0 || poll(&writable, 1, kPatience_ms) != 1) return false;
    const ssize_t sent = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool ZmtpPeer::receive_bytes(std::size_t count) {
  std::array<char, 256> buffer{};
  while (count > 0) {
    pollfd readable{fd_, POLLIN, 0};
    if (fd_ < 0 || poll(&readable, 1, kPatience_ms) != 1) return false;
    const ssize_t got = recv(fd_, buffer.data(), std::min(count, buffer.size()), 0);
    if (got <= 0) return false;
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

bool ZmtpPeer::sees_the_end() const {
  const timeval limit{10, 0};
  setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  std::array<char, 4096> buffer{};
  while (true) {
    const ssize_t got = recv(fd_, buffer.data(), buffer.size(), 0);
    if (got == 0 || (got < 0 && errno == ECONNRESET)) return true;
    if (got < 0) return false;
  }
}

bool ZmtpPeer::shake_hands() {
  return send_bytes(greeting()) && receive_bytes(64) && send_bytes(ready_command()) &&
         receive_bytes(2);
}

bool ZmtpPeer::greet() { return send_bytes(greeting() + ready_command()); }

bool ZmtpPeer::send_part(std::string_view body, bool more) {
  std::string bytes(1, static_cast<char>((more ? kMore : 0) | (body.size() > 255 ? kLong : 0)));
  bytes += big_endian(body.size(), body.size() > 255 ? 8 : 1);
  bytes += body;
  return send_bytes(bytes);
}

bool ZmtpPeer::claim_part(std::uint64_t size) {
  return send_bytes(std::string(1, kLong) + big_endian(size, 8));
}

}  // namespace brainshift::test_support
