// SPDX-License-Identifier: GPL-3.0-or-later
// The encodings that mesh files use: numbers of either byte order, base64, zlib. Errors are a
// sentence without the file name, which the caller puts in front.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/core/error.hpp"

namespace brainshift::io {

// The number whose bytes start at `bytes`; `swap` when the file has the other byte order.
template <typename T>
T load_number(const char* bytes, bool swap) {
  static_assert(std::is_arithmetic_v<T>);
  char buffer[sizeof(T)];
  std::memcpy(buffer, bytes, sizeof(T));
  if (swap) std::reverse(buffer, buffer + sizeof(T));
  T value;
  std::memcpy(&value, buffer, sizeof(T));
  return value;
}

template <typename T>
void append_number(std::string& out, T value) {
  static_assert(std::is_arithmetic_v<T>);
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// Bytes read one piece after the other, from raw or base64 text.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  // The next n bytes; kUnreadable if fewer are left.
  virtual Result<std::string> read(std::size_t n) = 0;
  // At most this many are left.
  virtual std::size_t remaining() const = 0;
};

class RawSource : public ByteSource {
 public:
  explicit RawSource(std::string_view bytes) : bytes_(bytes) {}
  Result<std::string> read(std::size_t n) override;
  std::size_t remaining() const override { return bytes_.size(); }

 private:
  std::string_view bytes_;
};

// Skips white space. Padding may also occur inside, where one encoded stream follows another: VTK
// encodes an array's header and its data apart, other writers together.
class Base64Source : public ByteSource {
 public:
  explicit Base64Source(std::string_view text) : text_(text) {}
  Result<std::string> read(std::size_t n) override;
  std::size_t remaining() const override { return text_.size() / 4 * 3 + 3 + decoded_.size(); }

 private:
  // Decodes the next four characters; false at the end or at a character that is not base64.
  bool decode_group();
  std::string_view text_;
  std::string decoded_;  // not yet handed out
};

std::string base64_encode(std::string_view bytes);

// zlib stream -> exactly `size` bytes; kUnreadable if it is damaged or of another size.
Result<std::string> zlib_expand(std::string_view compressed, std::size_t size);
std::string zlib_compress(std::string_view bytes);

}  // namespace brainshift::io
