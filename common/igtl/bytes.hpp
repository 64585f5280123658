// SPDX-License-Identifier: Apache-2.0
// Big-endian numbers and fixed-width texts in a string of bytes. Private to common/igtl.
//
// The order is written out byte by byte, so that it does not depend on the machine's.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::igtl {

static_assert(std::endian::native == std::endian::little ||
              std::endian::native == std::endian::big);

template <std::integral T>
void append_number(std::string& out, T value) {
  char bytes[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    const std::size_t shift = 8 * (sizeof(T) - 1 - i);
    bytes[i] = static_cast<char>((static_cast<std::uint64_t>(value) >> shift) & 0xffu);
  }
  out.append(bytes, sizeof(T));
}

inline void append_number(std::string& out, float value) {
  append_number(out, std::bit_cast<std::uint32_t>(value));
}

// Precondition: text.size() <= width.
void append_padded(std::string& out, std::string_view text, std::size_t width);

// Precondition: bytes.size() >= sizeof(T).
template <std::integral T>
T number_at_front(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = (value << 8) | static_cast<unsigned char>(bytes[i]);
  }
  return static_cast<T>(value);
}

// Reads from the front. A caller checks left() before it reads: taking more is a bug and asserts.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  std::size_t left() const { return rest_.size(); }
  std::string_view rest() const { return rest_; }
  std::string_view take(std::size_t count);
  // A field of this width, up to the first NUL.
  std::string_view take_padded(std::size_t width);
  template <std::integral T>
  T number() {
    return number_at_front<T>(take(sizeof(T)));
  }
  float real() { return std::bit_cast<float>(number<std::uint32_t>()); }

 private:
  std::string_view rest_;
};

// kInvalidArgument: "FIELD has N bytes, must have at most WIDTH", or it holds a NUL.
Status check_padded(std::string_view field, std::string_view text, std::size_t width);

// The same failure as a peer's: kProtocol.
inline tl::unexpected<Error> malformed(std::string message) {
  return fail(ErrorCode::kProtocol, std::move(message));
}
// kProtocol: "N bytes, must be WHICH SIZE" of a content; `which` is "", "at least " and the like.
tl::unexpected<Error> wrong_size(std::string_view content, std::string_view which,
                                 std::size_t size);
// kProtocol: "WHAT of N bytes, LEFT are left".
tl::unexpected<Error> does_not_fit(std::string_view what, std::uint64_t bytes, std::size_t left);

}  // namespace brainshift::igtl
