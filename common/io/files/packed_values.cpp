// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/packed_values.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <limits>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr std::size_t kLargestData = std::size_t{8} << 30;
// No deflate stream expands further than this (zlib's technical notes: 1032 to 1).
constexpr std::size_t kLargestRatio = 1040;

Result<std::size_t> expected_bytes(const PackedValues& packed, int bytes_per_value) {
  auto bytes = static_cast<std::size_t>(bytes_per_value);
  for (const std::int64_t size : packed.sizes) {
    if (size == 0) return std::size_t{0};
    if (bytes > kLargestData / static_cast<std::size_t>(size)) {
      return unreadable("its sizes promise more than 8 GiB of pixels");
    }
    bytes *= static_cast<std::size_t>(size);
  }
  return bytes;
}

// zlib or gzip stream, whichever it is, in pieces: zlib counts its buffers with 32 bits.
Result<std::string> inflate_all(std::string_view compressed, std::size_t size) {
  if (size / kLargestRatio > compressed.size()) {
    return unreadable(
        fmt::format("its sizes promise {} bytes of pixels: {} compressed ones are too few", size,
                    compressed.size()));
  }
  std::string expanded(size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 32) != Z_OK) return fail(ErrorCode::kInternal, "zlib: no memory");
  std::size_t read = 0, written = 0;
  int state = Z_OK;
  char surplus = 0;  // where a byte too many goes
  while (state == Z_OK) {
    constexpr std::size_t kPiece = std::numeric_limits<uInt>::max();
    const auto in = static_cast<uInt>(std::min(kPiece, compressed.size() - read));
    const auto out = static_cast<uInt>(std::min(kPiece, size - written));
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(compressed.data() + read));
    stream.avail_in = in;
    stream.next_out = reinterpret_cast<Bytef*>(out > 0 ? expanded.data() + written : &surplus);
    stream.avail_out = out > 0 ? out : 1;
    state = inflate(&stream, Z_NO_FLUSH);
    read += in - stream.avail_in;
    if (out == 0 && stream.avail_out == 0) {
      written = size + 1;
      break;
    }
    if (out > 0) written += out - stream.avail_out;
  }
  inflateEnd(&stream);
  if (written > size) return unreadable("its pixels are more than its sizes say");
  if (state != Z_STREAM_END || written != size) {
    return unreadable(fmt::format("its compressed pixels are {}: {} of {} bytes",
                                  state == Z_DATA_ERROR ? "damaged" : "truncated", written, size));
  }
  return expanded;
}

}  // namespace

std::string element_type(const std::string& name) {
  const std::string word = lower_case(name);
  // The first of each row is ours.
  static const std::vector<std::vector<std::string>> kNames = {
      {"int8", "met_char", "signed char", "int8_t"},
      {"uint8", "met_uchar", "uchar", "unsigned char", "uint8_t"},
      {"int16", "met_short", "short", "short int", "int16_t", "signed short", "signed short int"},
      {"uint16", "met_ushort", "ushort", "unsigned short", "uint16_t", "unsigned short int"},
      {"int32", "met_int", "int", "signed int", "int32_t"},
      {"uint32", "met_uint", "uint", "unsigned int", "uint32_t"},
      {"int64", "longlong", "long long", "long long int", "signed long long",
       "signed long long int", "int64_t"},
      {"uint64", "ulonglong", "unsigned long long", "unsigned long long int", "uint64_t"},
      {"float", "met_float"},
      {"double", "met_double"}};
  for (const auto& names : kNames) {
    if (std::find(names.begin(), names.end(), word) != names.end()) return names.front();
  }
  return name;
}

Result<std::vector<std::int64_t>> parse_sizes(const std::string& field, std::string_view text,
                                              std::int64_t least) {
  std::vector<std::int64_t> sizes;
  for (std::string_view rest = trimmed(text); !rest.empty(); rest = trimmed(rest)) {
    std::int64_t size = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), size);
    if (error != std::errc() || size < least || size > kLargestSize) {
      return unreadable(
          fmt::format("{} = {}: every size must be {} to {}", field, text, least, kLargestSize));
    }
    sizes.push_back(size);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  return sizes;
}

Result<std::string> unpack(const PackedValues& packed, int bytes_per_value) {
  const auto size = expected_bytes(packed, bytes_per_value);
  if (!size) return tl::unexpected(size.error());
  std::string values;
  if (packed.compressed) {
    auto expanded = inflate_all(packed.data, *size);
    if (!expanded) return tl::unexpected(expanded.error());
    values = std::move(*expanded);
  } else {
    if (packed.data.size() != *size) {
      return unreadable(
          fmt::format("holds {} bytes of pixels, its sizes say {}", packed.data.size(), *size));
    }
    values = std::string(packed.data);
  }
  const bool swap = packed.big_endian != (std::endian::native == std::endian::big);
  if (swap && bytes_per_value > 1) {
    const auto step = static_cast<std::ptrdiff_t>(bytes_per_value);
    for (auto at = values.begin(); at != values.end(); at += step) std::reverse(at, at + step);
  }
  return values;
}

}  // namespace brainshift::io
