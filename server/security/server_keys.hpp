// SPDX-License-Identifier: GPL-3.0-or-later
// ServerKeys: with what the daemon proves who it is, and whom it knows.
#pragma once

#include <map>
#include <string>

#include "common/io/config/role.hpp"

namespace brainshift::server {

// Names by public key (Z85).
using KeyNames = std::map<std::string, std::string>;

struct ServerKeys {
  std::string secret_key;             // the daemon's, Z85
  KeyNames names;                     // of the clients, by public key
  std::map<std::string, Role> roles;  // of the clients, by name
};

}  // namespace brainshift::server
