// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/crc64.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace brainshift::igtl {
namespace {

constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693u;
constexpr std::size_t kSlice = 8;
using Table = std::array<std::uint64_t, 256>;

// tables[s][b]: what byte b adds to the checksum when s more bytes follow it.
constexpr std::array<Table, kSlice> make_tables() {
  std::array<Table, kSlice> tables{};
  for (std::size_t byte = 0; byte < 256; ++byte) {
    std::uint64_t crc = std::uint64_t{byte} << 56;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc >> 63) != 0 ? kPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t s = 1; s < kSlice; ++s) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint64_t before = tables[s - 1][byte];
      tables[s][byte] = (before << 8) ^ tables[0][before >> 56];
    }
  }
  return tables;
}

constexpr std::array<Table, kSlice> kTables = make_tables();

// Big-endian, whatever the machine's order is.
std::uint64_t load(const char* bytes) {
  std::uint64_t value = 0;
  std::memcpy(&value, bytes, sizeof value);
  if constexpr (std::endian::native == std::endian::little) value = __builtin_bswap64(value);
  return value;
}

}  // namespace

std::uint64_t continue_crc64(std::uint64_t crc, std::string_view bytes) {
  const char* at = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= kSlice; at += kSlice, left -= kSlice) {
    const std::uint64_t block = crc ^ load(at);
    crc = kTables[7][block >> 56] ^ kTables[6][(block >> 48) & 0xff] ^
          kTables[5][(block >> 40) & 0xff] ^ kTables[4][(block >> 32) & 0xff] ^
          kTables[3][(block >> 24) & 0xff] ^ kTables[2][(block >> 16) & 0xff] ^
          kTables[1][(block >> 8) & 0xff] ^ kTables[0][block & 0xff];
  }
  for (; left > 0; ++at, --left) {
    crc = (crc << 8) ^ kTables[0][(crc >> 56) ^ static_cast<unsigned char>(*at)];
  }
  return crc;
}

}  // namespace brainshift::igtl
