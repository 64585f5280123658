// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/binary_codec.hpp"

#include <zlib.h>

#include <array>
#include <cassert>

namespace brainshift::io {
namespace {

constexpr std::string_view kAlphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Value of each character; -1 for those outside the alphabet.
constexpr std::array<int, 256> kValues = [] {
  std::array<int, 256> values{};
  values.fill(-1);
  for (std::size_t i = 0; i < kAlphabet.size(); ++i) {
    values[static_cast<unsigned char>(kAlphabet[i])] = static_cast<int>(i);
  }
  return values;
}();

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

}  // namespace

Result<std::string> RawSource::read(std::size_t n) {
  if (n > bytes_.size()) return fail(ErrorCode::kUnreadable, "data end too early");
  std::string out(bytes_.substr(0, n));
  bytes_.remove_prefix(n);
  return out;
}

bool Base64Source::decode_group() {
  unsigned bits = 0;
  int characters = 0;
  int padding = 0;
  while (characters < 4) {
    while (!text_.empty() && is_space(text_.front())) text_.remove_prefix(1);
    if (text_.empty()) return false;
    const char c = text_.front();
    const int value = kValues[static_cast<unsigned char>(c)];
    if (c == '=' && characters >= 2) {
      ++padding;
    } else if (value < 0 || padding > 0) {
      return false;
    }
    bits = bits << 6 | static_cast<unsigned>(value < 0 ? 0 : value);
    ++characters;
    text_.remove_prefix(1);
  }
  for (int byte = 0; byte < 3 - padding; ++byte) {
    decoded_ += static_cast<char>(bits >> (16 - 8 * byte) & 0xffu);
  }
  return true;
}

Result<std::string> Base64Source::read(std::size_t n) {
  if (n > remaining()) return fail(ErrorCode::kUnreadable, "base64 data end too early");
  while (decoded_.size() < n) {
    if (!decode_group()) {
      return fail(ErrorCode::kUnreadable, "base64 data end too early or have a foreign character");
    }
  }
  std::string out = decoded_.substr(0, n);
  decoded_.erase(0, n);
  return out;
}

std::string base64_encode(std::string_view bytes) {
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= count ? kAlphabet[bits >> (18 - 6 * k) & 63u] : '=';
    }
  }
  return out;
}

Result<std::string> zlib_expand(std::string_view compressed, std::size_t size) {
  std::string out(size, '\0');
  uLongf length = size;
  const int status =
      uncompress(reinterpret_cast<Bytef*>(out.data()), &length,
                 reinterpret_cast<const Bytef*>(compressed.data()), compressed.size());
  if (status != Z_OK || length != size) {
    return fail(ErrorCode::kUnreadable, "zlib data are damaged or of the wrong size");
  }
  return out;
}

std::string zlib_compress(std::string_view bytes) {
  uLongf length = compressBound(bytes.size());
  std::string out(length, '\0');
  // Fails only for lack of memory or room; room is given.
  [[maybe_unused]] const int status =
      compress2(reinterpret_cast<Bytef*>(out.data()), &length,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_DEFAULT_COMPRESSION);
  assert(status == Z_OK);
  out.resize(length);
  return out;
}

}  // namespace brainshift::io
