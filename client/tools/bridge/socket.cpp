// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/socket.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <utility>

namespace brainshift::client {
namespace {

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

Result<AddressList> look_up(const Address& address, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* list = nullptr;
  const int error =
      getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  if (error != 0) return invalid(to_string(address) + ": " + gai_strerror(error));
  return AddressList(list, &freeaddrinfo);
}

tl::unexpected<Error> unavailable(const std::string& what) {
  return fail(ErrorCode::kUnavailable, what + ": " + std::strerror(errno));
}

int open_socket(const addrinfo& at) {
  return ::socket(at.ai_family, at.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, at.ai_protocol);
}

void set(int descriptor, int level, int option, int value) {
  // A system that refuses one of them serves all the same.
  static_cast<void>(setsockopt(descriptor, level, option, &value, sizeof value));
}

void prepare_connection(int descriptor) {
  set(descriptor, SOL_SOCKET, SO_SNDBUF, Socket::kSendBuffer);
  set(descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
  set(descriptor, SOL_SOCKET, SO_KEEPALIVE, 1);
}

Address address_of(const sockaddr_storage& storage, socklen_t size) {
  char host[NI_MAXHOST] = {}, port[NI_MAXSERV] = {};
  if (getnameinfo(reinterpret_cast<const sockaddr*>(&storage), size, host, sizeof host, port,
                  sizeof port, NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
    return {"?", 0};
  }
  return {host, static_cast<std::uint16_t>(std::stoi(port))};
}

bool no_room_now() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

Result<Address> parse_address(std::string_view option, std::string_view text) {
  const auto refuse = [&] {
    return invalid(std::string(option) + " " + std::string(text) +
                   ": must be ADDRESS:PORT, like 127.0.0.1:18945 or [::1]:18945");
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return refuse();
  Address address;
  std::string_view host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) {
    host = host.substr(1, host.size() - 2);
    if (host.empty()) return refuse();
  } else if (host.find(':') != std::string_view::npos) {
    return refuse();  // where an IPv6 address ends and the port begins is not clear
  }
  if (host.find_first_of(" \t[]/") != std::string_view::npos) return refuse();
  if (!host.empty()) address.host = host;
  const std::string_view port = text.substr(colon + 1);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (port.empty() || error != std::errc() || end != port.data() + port.size()) return refuse();
  return address;
}

std::string to_string(const Address& address) {
  const bool v6 = address.host.find(':') != std::string::npos;
  return (v6 ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

bool is_loopback(const Address& address) {
  return address.host == "localhost" || address.host == "::1" || address.host.starts_with("127.");
}

Result<Socket> Socket::listen(const Address& address) {
  const auto list = look_up(address, AI_PASSIVE);
  if (!list) return tl::unexpected(list.error());
  Socket socket(open_socket(**list));
  if (socket.descriptor_ < 0) return unavailable(to_string(address));
  set(socket.descriptor_, SOL_SOCKET, SO_REUSEADDR, 1);
  constexpr int kWaiting = 16;
  if (::bind(socket.descriptor_, (*list)->ai_addr, (*list)->ai_addrlen) != 0 ||
      ::listen(socket.descriptor_, kWaiting) != 0) {
    return unavailable("cannot listen on " + to_string(address));
  }
  return socket;
}

Result<Socket> Socket::connect(const Address& address) {
  const auto list = look_up(address, 0);
  if (!list) return fail(ErrorCode::kUnavailable, list.error().message);
  Socket socket(open_socket(**list));
  if (socket.descriptor_ < 0) return unavailable(to_string(address));
  prepare_connection(socket.descriptor_);
  if (::connect(socket.descriptor_, (*list)->ai_addr, (*list)->ai_addrlen) != 0 &&
      errno != EINPROGRESS) {
    return unavailable("cannot connect to " + to_string(address));
  }
  return socket;
}

Socket::Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
Socket& Socket::operator=(Socket&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}
Socket::~Socket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Address Socket::local() const {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (getsockname(descriptor_, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return {"?", 0};
  return address_of(storage, size);
}

std::string Socket::peer_name() const {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (getpeername(descriptor_, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return "?";
  if (storage.ss_family != AF_INET && storage.ss_family != AF_INET6) return "local";
  return to_string(address_of(storage, size));
}

std::optional<Socket> Socket::accept() {
  const int descriptor = ::accept4(descriptor_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (descriptor < 0) return std::nullopt;
  prepare_connection(descriptor);
  return Socket(descriptor);
}

Status Socket::connected() const {
  int error = 0;
  socklen_t size = sizeof error;
  if (getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size) != 0) error = errno;
  if (error == 0) return {};
  return fail(ErrorCode::kUnavailable, std::strerror(error));
}

Result<std::size_t> Socket::read(char* buffer, std::size_t size) {
  const ssize_t count = ::recv(descriptor_, buffer, size, 0);
  if (count > 0) return static_cast<std::size_t>(count);
  if (count == 0) return fail(ErrorCode::kUnavailable, "the other side closed the connection");
  if (no_room_now()) return std::size_t{0};
  return unavailable("lost the connection");
}

Result<std::size_t> Socket::write(std::string_view bytes) {
  const ssize_t count = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (count >= 0) return static_cast<std::size_t>(count);
  if (no_room_now()) return std::size_t{0};
  return unavailable("lost the connection");
}

}  // namespace brainshift::client
