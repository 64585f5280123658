// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ranks/ranks.hpp"

#include <cstring>

namespace brainshift {

// Code and sentence, or nothing.
Status Ranks::agree(const Status& own) {
  Bytes message;
  if (!own) {
    message.resize(1 + own.error().message.size());
    message[0] = static_cast<std::byte>(own.error().code);
    std::memcpy(message.data() + 1, own.error().message.data(), own.error().message.size());
  }
  for (const Bytes& told :
       exchange(std::vector<Bytes>(static_cast<std::size_t>(size()), message))) {
    if (told.empty()) continue;
    return fail(static_cast<ErrorCode>(told[0]),
                std::string(reinterpret_cast<const char*>(told.data()) + 1, told.size() - 1));
  }
  return {};
}

}  // namespace brainshift
