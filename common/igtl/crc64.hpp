// SPDX-License-Identifier: Apache-2.0
// The checksum of OpenIGTLink: CRC-64 with the polynomial of ECMA-182,
//   x^64 + x^62 + x^57 + x^55 + x^54 + x^53 + x^52 + x^47 + x^46 + x^45 + x^40 + x^39 + x^38 + x^37
//   + x^35 + x^33 + x^32 + x^31 + x^29 + x^27 + x^24 + x^23 + x^22 + x^21 + x^19 + x^17 + x^13
//   + x^12 + x^10 + x^9 + x^7 + x^4 + x + 1  (0x42F0E1EBA9EA3693),
// most significant bit first, initial value 0, no final exclusive or. The check value of
// "123456789" is 0x6C40DF5F0B497347.
//
// Eight bytes at a time with eight tables: a field of 2 million voxels, 25 MB, is summed in about
// 15 ms. Source: ECMA-182 (1992) annex B; slicing: Kounavis and Berry, IEEE ISCC 2005.
#pragma once

#include <cstdint>
#include <string_view>

namespace brainshift::igtl {

// The checksum of what `crc` already covers, followed by `bytes`. Start with 0.
std::uint64_t continue_crc64(std::uint64_t crc, std::string_view bytes);

inline std::uint64_t crc64(std::string_view bytes) { return continue_crc64(0, bytes); }

}  // namespace brainshift::igtl
