// SPDX-License-Identifier: Apache-2.0
#include "common/core/text.hpp"

#include <cstddef>
#include <cstdint>

namespace brainshift {
namespace {

bool in_range(unsigned char byte, unsigned low, unsigned high) {
  return byte >= low && byte <= high;
}

// Length of the well-formed UTF-8 sequence at the start of `text`, 0 if there is none. Only the
// range of the second byte depends on the first one (no overlong forms, no surrogates, at most
// U+10FFFF).
std::size_t sequence_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  if (!in_range(first, 0xc2, 0xf4)) return 0;
  const std::size_t length = first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  if (text.size() < length) return 0;
  const unsigned low = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
  const unsigned high = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
  if (!in_range(byte(1), low, high)) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if (!in_range(byte(i), 0x80, 0xbf)) return 0;
  }
  return length;
}

// Of a well-formed sequence of `length` bytes.
std::uint32_t code_point(std::string_view text, std::size_t length) {
  static constexpr unsigned kFirstBits[] = {0, 0x7f, 0x1f, 0x0f, 0x07};
  std::uint32_t value = static_cast<unsigned char>(text[0]) & kFirstBits[length];
  for (std::size_t i = 1; i < length; ++i) {
    value = value << 6 | (static_cast<unsigned char>(text[i]) & 0x3fu);
  }
  return value;
}

bool is_shown(std::uint32_t c) {
  const auto within = [c](std::uint32_t low, std::uint32_t high) { return c >= low && c <= high; };
  return c >= 0x20 && !within(0x7f, 0x9f) && c != 0x61c && !within(0x200b, 0x200f) &&
         !within(0x2028, 0x202e) && !within(0x2060, 0x206f) && c != 0xfeff;
}

constexpr std::size_t kMaxQuoted = 64;

}  // namespace

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string to_utf8(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    if (length == 0) {
      out.push_back('?');
      text.remove_prefix(1);
    } else {
      out.append(text.substr(0, length));
      text.remove_prefix(length);
    }
  }
  return out;
}

std::string one_line(std::string_view text, char instead) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    if (length > 0 && is_shown(code_point(text, length))) {
      out.append(text.substr(0, length));
    } else {
      out.push_back(instead);
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return out;
}

std::string in_quotes(std::string_view text) {
  std::size_t end = 0;
  for (std::size_t count = 0; end < text.size() && count < kMaxQuoted; ++count) {
    const std::size_t length = sequence_length(text.substr(end));
    end += length > 0 ? length : 1;
  }
  return '"' + one_line(text.substr(0, end), '?') + (end < text.size() ? "...\"" : "\"");
}

}  // namespace brainshift
