// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/header.hpp"

#include <algorithm>
#include <cassert>

#include "common/igtl/bytes.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }
bool is_printable_ascii(char c) { return c > 0x20 && c < 0x7f; }

std::string hex(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    text += kDigits[static_cast<unsigned char>(c) >> 4];
    text += kDigits[static_cast<unsigned char>(c) & 0xfu];
  }
  return text;
}

}  // namespace

Timestamp to_timestamp(std::chrono::nanoseconds since_1970) {
  const std::int64_t seconds = since_1970.count() / kNanosecondsPerSecond;
  const std::int64_t rest = since_1970.count() % kNanosecondsPerSecond;
  assert(since_1970.count() >= 0 && seconds <= UINT32_MAX);
  const std::uint64_t scaled = static_cast<std::uint64_t>(rest) << 32;
  const std::uint64_t fraction = (scaled + kNanosecondsPerSecond - 1) / kNanosecondsPerSecond;
  return (static_cast<std::uint64_t>(seconds) << 32) | fraction;
}

std::chrono::nanoseconds to_nanoseconds(Timestamp timestamp) {
  const auto seconds = static_cast<std::int64_t>(timestamp >> 32);
  const std::uint64_t fraction = timestamp & 0xffffffffu;
  const std::uint64_t nanoseconds = (fraction * kNanosecondsPerSecond) >> 32;
  return std::chrono::nanoseconds(seconds * kNanosecondsPerSecond +
                                  static_cast<std::int64_t>(nanoseconds));
}

Status validate(const Header& header) {
  if (header.version != 1 && header.version != 2) {
    return invalid("header version " + std::to_string(header.version) + ", must be 1 or 2");
  }
  if (header.type.empty()) return invalid("message type is empty");
  if (Status status = check_padded("message type", header.type, kMaxTypeBytes); !status) {
    return status;
  }
  if (!std::all_of(header.type.begin(), header.type.end(), is_printable_ascii)) {
    return invalid("message type is not printable ASCII: 0x" + hex(header.type));
  }
  if (Status status = check_padded("device name", header.device, kMaxDeviceBytes); !status) {
    return status;
  }
  if (std::any_of(header.device.begin(), header.device.end(), is_control)) {
    return invalid("device name holds a control character: 0x" + hex(header.device));
  }
  return {};
}

std::string encode_header(const Header& header) {
  assert(validate(header));
  std::string out;
  out.reserve(kHeaderBytes);
  append_number(out, header.version);
  append_padded(out, header.type, kMaxTypeBytes);
  append_padded(out, header.device, kMaxDeviceBytes);
  append_number(out, header.timestamp);
  append_number(out, header.body_bytes);
  append_number(out, header.crc);
  return out;
}

Result<Header> decode_header(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) {
    return malformed("header of " + std::to_string(bytes.size()) + " bytes, must have " +
                     std::to_string(kHeaderBytes));
  }
  ByteReader reader(bytes);
  Header header;
  header.version = reader.number<std::uint16_t>();
  header.type = reader.take_padded(kMaxTypeBytes);
  header.device = reader.take_padded(kMaxDeviceBytes);
  header.timestamp = reader.number<std::uint64_t>();
  header.body_bytes = reader.number<std::uint64_t>();
  header.crc = reader.number<std::uint64_t>();
  if (const Status status = validate(header); !status) return malformed(status.error().message);
  return header;
}

Status check_crc(const Header& header, std::uint64_t crc_of_body) {
  if (crc_of_body == header.crc) return {};
  return malformed(header.type + " of \"" + header.device +
                   "\": the CRC-64 does not match the body");
}

}  // namespace brainshift::igtl
