// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/address.hpp"

#include <charconv>

namespace brainshift::client {

Result<Address> parse_address(std::string_view option, std::string_view text) {
  const auto refuse = [&] {
    return fail(ErrorCode::kInvalidArgument,
                std::string(option) + " " + std::string(text) +
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

}  // namespace brainshift::client
