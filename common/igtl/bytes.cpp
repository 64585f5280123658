// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/bytes.hpp"

#include <cassert>

namespace brainshift::igtl {

void append_padded(std::string& out, std::string_view text, std::size_t width) {
  assert(text.size() <= width);
  out.append(text).append(width - text.size(), '\0');
}

std::string_view ByteReader::take(std::size_t count) {
  assert(count <= rest_.size());
  const std::string_view taken = rest_.substr(0, count);
  rest_.remove_prefix(count);
  return taken;
}

std::string_view ByteReader::take_padded(std::size_t width) {
  const std::string_view field = take(width);
  return field.substr(0, field.find('\0'));
}

Status check_padded(std::string_view field, std::string_view text, std::size_t width) {
  if (text.size() > width) {
    return invalid(std::string(field) + " has " + std::to_string(text.size()) +
                   " bytes, must have at most " + std::to_string(width));
  }
  if (text.find('\0') != std::string_view::npos) {
    return invalid(std::string(field) + " holds a NUL");
  }
  return {};
}

tl::unexpected<Error> wrong_size(std::string_view content, std::string_view which,
                                 std::size_t size) {
  return malformed(std::to_string(content.size()) + " bytes, must be " + std::string(which) +
                   std::to_string(size));
}

tl::unexpected<Error> does_not_fit(std::string_view what, std::uint64_t bytes, std::size_t left) {
  return malformed(std::string(what) + " of " + std::to_string(bytes) + " bytes, " +
                   std::to_string(left) + " are left");
}

}  // namespace brainshift::igtl
