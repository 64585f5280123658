// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/crc64.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace brainshift::igtl {
namespace {

// The definition: one bit at a time, the remainder of a division of polynomials.
std::uint64_t bit_by_bit(std::string_view bytes) {
  std::uint64_t crc = 0;
  for (const char c : bytes) {
    crc ^= std::uint64_t{static_cast<unsigned char>(c)} << 56;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc << 1) ^ ((crc >> 63) != 0 ? 0x42F0E1EBA9EA3693u : 0u);
    }
  }
  return crc;
}

std::string random_bytes(std::size_t size) {
  std::mt19937 random(5);
  std::string bytes(size, '\0');
  for (char& c : bytes) c = static_cast<char>(random() & 0xffu);
  return bytes;
}

TEST(Crc64, IsTheCheckValueOfEcma182) { EXPECT_EQ(crc64("123456789"), 0x6C40DF5F0B497347u); }

TEST(Crc64, OfNothingIsZero) { EXPECT_EQ(crc64(""), 0u); }

TEST(Crc64, IsTheDivisionOfPolynomialsForEveryLengthAndAlignment) {
  const std::string bytes = random_bytes(100);
  for (std::size_t begin = 0; begin < 9; ++begin) {
    for (std::size_t size = 0; begin + size <= bytes.size(); ++size) {
      const std::string_view part = std::string_view(bytes).substr(begin, size);
      ASSERT_EQ(crc64(part), bit_by_bit(part)) << begin << " " << size;
    }
  }
}

TEST(Crc64, ContinuesAtEveryPlace) {
  const std::string bytes = random_bytes(67);
  const std::string_view all = bytes;
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    EXPECT_EQ(continue_crc64(crc64(all.substr(0, cut)), all.substr(cut)), crc64(all)) << cut;
  }
}

TEST(Crc64, NoticesEveryFlippedBit) {
  const std::string bytes = random_bytes(40);
  for (std::size_t i = 0; i < 8 * bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i / 8] = static_cast<char>(damaged[i / 8] ^ (1 << (i % 8)));
    EXPECT_NE(crc64(damaged), crc64(bytes)) << i;
  }
}

}  // namespace
}  // namespace brainshift::igtl
