// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers behind the text header of an image file (MetaImage, NRRD): raw or compressed by zlib
// or gzip, in either byte order.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

// What a header says of them. Readers of headers fill it in and have checked each size.
struct PackedValues {
  std::vector<std::int64_t> sizes;  // fastest first, each 0 to kLargestSize
  // "int8", "uint8", ..., "uint64", "float", "double"; any other as the file has it
  std::string element_type;
  bool big_endian = false;
  bool compressed = false;
  std::string_view data;  // the bytes behind the header; refers to the content that was parsed
};
inline constexpr std::int64_t kLargestSize = 1'000'000;

// A name of a type in MetaImage or NRRD, in any case, as one of those above; others unchanged.
std::string element_type(const std::string& name);

// The whole numbers of `text` between blanks. kUnreadable, "FIELD = TEXT: ...", unless each of them
// is `least` to kLargestSize.
Result<std::vector<std::int64_t>> parse_sizes(const std::string& field, std::string_view text,
                                              std::int64_t least);

// The values as the file orders them, expanded, in native byte order: product(sizes) x
// bytes_per_value bytes. kUnreadable for data that are truncated, damaged, longer than the sizes
// say, or above 8 GiB.
Result<std::string> unpack(const PackedValues& packed, int bytes_per_value);

}  // namespace brainshift::io
