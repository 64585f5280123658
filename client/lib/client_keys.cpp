// SPDX-License-Identifier: Apache-2.0
#include "client/lib/client_keys.hpp"

#include <zmq.h>

#include <array>
#include <cerrno>

namespace brainshift::client {
namespace {

using KeyText = std::array<char, 41>;  // with the zero at its end

}  // namespace

Result<NewKeys> new_keys() {
  KeyText public_key{};
  KeyText secret_key{};
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0) {
    return fail(ErrorCode::kInternal, std::string("cannot make keys: ") + zmq_strerror(errno));
  }
  return NewKeys{public_key.data(), secret_key.data()};
}

Result<std::string> public_key_of(const std::string& secret_key) {
  KeyText public_key{};
  if (secret_key.size() != public_key.size() - 1 ||
      zmq_curve_public(public_key.data(), secret_key.c_str()) != 0) {
    return invalid("the secret key must be 40 characters in Z85");
  }
  return std::string(public_key.data());
}

}  // namespace brainshift::client
