// SPDX-License-Identifier: Apache-2.0
// FNV-1a, 64 bit: a hash that tells contents apart; it is no cryptographic signature.
// Source: Fowler, Noll, Vo; draft-eastlake-fnv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace brainshift {

class Fnv1a {
 public:
  void add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash_ = (hash_ ^ bytes[i]) * 1099511628211ull;
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

inline std::uint64_t fnv1a(std::string_view bytes) {
  Fnv1a hash;
  hash.add(bytes.data(), bytes.size());
  return hash.value();
}

}  // namespace brainshift
