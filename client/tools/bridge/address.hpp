// SPDX-License-Identifier: GPL-3.0-or-later
// Where a socket listens or connects to, as it is written on a command line.
//
//   127.0.0.1:18945    [::1]:18945    slicer.local:18944    :18945 (this computer only)
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::client {

struct Address {
  std::string host = "127.0.0.1";  // a name or a number, without brackets
  std::uint16_t port = 0;          // 0: the system chooses one

  bool operator==(const Address&) const = default;
};

// kInvalidArgument: names the option, its text and what it must be.
Result<Address> parse_address(std::string_view option, std::string_view text);
// "127.0.0.1:18945", "[::1]:18945".
std::string to_string(const Address& address);
// Only programs of this computer reach it. A name other than localhost counts as no loopback.
bool is_loopback(const Address& address);

}  // namespace brainshift::client
