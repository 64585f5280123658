// SPDX-License-Identifier: Apache-2.0
// CURVE keys as texts: 40 characters of Z85 that stand for 32 bytes (docs/security.md).
#pragma once

#include <string>

#include "common/core/error.hpp"

namespace brainshift::client {

// For a daemon that asks for keys.
struct ClientKeys {
  std::string server_public_key;  // the daemon's: who has not its other half is not talked to
  std::string public_key;         // this client's; stands in the daemon's allow-list
  std::string secret_key;
};

struct NewKeys {
  std::string public_key;
  std::string secret_key;
};

// A new pair, from the system's random numbers. kInternal when ZeroMQ was built without CURVE.
Result<NewKeys> new_keys();

// The public key that belongs to a secret one. kInvalidArgument for a text that is no key.
Result<std::string> public_key_of(const std::string& secret_key);

}  // namespace brainshift::client
