// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/listener.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

namespace brainshift::server {
namespace {

constexpr const char* kTcp = "tcp://";
constexpr const char* kIpc = "ipc://";
// Connections that wait for a place.
constexpr int kBacklog = 128;
constexpr int kType = SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC;

struct Address {
  sockaddr_storage bytes{};
  socklen_t size = 0;
};

tl::unexpected<Error> refuse(ErrorCode code, const std::string& endpoint, const std::string& why) {
  return fail(code, fmt::format("endpoint {}: {}", endpoint, why));
}

tl::unexpected<Error> system_failure(const std::string& endpoint) {
  return refuse(ErrorCode::kUnavailable, endpoint, std::generic_category().message(errno));
}

// The address of an interface of this name.
std::optional<Address> interface_address(const std::string& name) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return std::nullopt;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owned(all, &freeifaddrs);
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || name != one->ifa_name) {
      continue;
    }
    Address address;
    address.size = sizeof(sockaddr_in);
    std::memcpy(&address.bytes, one->ifa_addr, address.size);
    return address;
  }
  return std::nullopt;
}

std::optional<Address> named_address(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* all = nullptr;
  if (getaddrinfo(host == "*" ? "0.0.0.0" : host.c_str(), "0", &hints, &all) != 0) {
    return std::nullopt;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(all, &freeaddrinfo);
  const addrinfo* chosen = all;
  for (const addrinfo* one = all; one != nullptr; one = one->ai_next) {
    if (one->ai_family == AF_INET) {
      chosen = one;
      break;
    }
  }
  Address address;
  address.size = chosen->ai_addrlen;
  std::memcpy(&address.bytes, chosen->ai_addr, address.size);
  return address;
}

void set_port(Address& address, std::uint16_t port) {
  if (address.bytes.ss_family == AF_INET) {
    reinterpret_cast<sockaddr_in&>(address.bytes).sin_port = htons(port);
  } else {
    reinterpret_cast<sockaddr_in6&>(address.bytes).sin6_port = htons(port);
  }
}

std::string bound_endpoint(int fd) {
  sockaddr_storage bytes{};
  socklen_t size = sizeof bytes;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&bytes), &size) != 0) return {};
  char text[INET6_ADDRSTRLEN] = {};
  if (bytes.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(bytes);
    inet_ntop(AF_INET, &v4.sin_addr, text, sizeof text);
    return fmt::format("tcp://{}:{}", text, ntohs(v4.sin_port));
  }
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(bytes);
  inet_ntop(AF_INET6, &v6.sin6_addr, text, sizeof text);
  return fmt::format("tcp://[{}]:{}", text, ntohs(v6.sin6_port));
}

}  // namespace

Listener::Listener(Listener&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), endpoint_(std::move(other.endpoint_)) {}

Listener::~Listener() {
  if (fd_ < 0) return;
  ::close(fd_);
  if (endpoint_.rfind(kIpc, 0) == 0) unlink(endpoint_.c_str() + std::strlen(kIpc));
}

Result<Listener> Listener::open(const std::string& endpoint) {
  if (endpoint.rfind(kTcp, 0) == 0) return open_tcp(endpoint);
  if (endpoint.rfind(kIpc, 0) == 0) return open_ipc(endpoint);
  return refuse(ErrorCode::kInvalidArgument, endpoint, "must be tcp://HOST:PORT or ipc://PATH");
}

Result<Listener> Listener::open_tcp(const std::string& endpoint) {
  const std::string rest = endpoint.substr(std::strlen(kTcp));
  const auto colon = rest.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return refuse(ErrorCode::kInvalidArgument, endpoint, "must be tcp://HOST:PORT");
  }
  std::string host = rest.substr(0, colon);
  const std::string port = rest.substr(colon + 1);
  const bool digits =
      !port.empty() && port.size() <= 5 &&
      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  const int number = digits ? std::stoi(port) : 0;
  if ((port != "*" && !digits) || number > 65535) {
    return refuse(ErrorCode::kInvalidArgument, endpoint, "the port must be * or 0 to 65535");
  }
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  auto address = interface_address(host);
  if (!address) address = named_address(host);
  if (!address) return refuse(ErrorCode::kUnavailable, endpoint, "no such address or interface");
  set_port(*address, static_cast<std::uint16_t>(number));
  const int fd = socket(address->bytes.ss_family, kType, 0);
  if (fd < 0) return system_failure(endpoint);
  const int yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  Listener listener(fd, endpoint);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address->bytes), address->size) != 0 ||
      listen(fd, kBacklog) != 0) {
    return system_failure(endpoint);
  }
  listener.endpoint_ = bound_endpoint(fd);
  return listener;
}

Result<Listener> Listener::open_ipc(const std::string& endpoint) {
  const std::string path = endpoint.substr(std::strlen(kIpc));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return refuse(ErrorCode::kInvalidArgument, endpoint, "must name a path of a socket's length");
  }
  path.copy(address.sun_path, path.size());
  const int fd = socket(AF_UNIX, kType, 0);
  if (fd < 0) return system_failure(endpoint);
  unlink(path.c_str());
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(fd, kBacklog) != 0) {
    auto failure = system_failure(endpoint);
    ::close(fd);
    return failure;
  }
  return Listener(fd, endpoint);
}

}  // namespace brainshift::server
