// SPDX-License-Identifier: Apache-2.0
#include "common/wire/frame.hpp"

#include <zlib.h>

#include <cassert>

namespace brainshift::wire {
namespace {

constexpr std::string_view kMagic = "BSFT";
constexpr std::size_t kVersionOffset = 4;
constexpr std::size_t kTypeOffset = 6;
constexpr std::size_t kSizeOffset = 8;
constexpr std::size_t kCrcOffset = 12;
constexpr std::size_t kRequestIdOffset = 16;
constexpr std::uint16_t kRetiredType = 8;

// Byte by byte, so that the layout does not depend on the machine's byte order.
template <typename T>
void append_little_endian(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xffu));
  }
}

template <typename T>
T read_little_endian(std::string_view bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[offset + i])) << (8 * i);
  }
  return static_cast<T>(value);
}

std::uint32_t continue_crc(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// Of a header, whose own CRC field may hold anything, and its payload.
std::uint32_t crc_of(std::string_view header, std::string_view payload) {
  const std::uint32_t crc = continue_crc(0, header.substr(0, kCrcOffset));
  return continue_crc(continue_crc(crc, header.substr(kRequestIdOffset)), payload);
}

bool is_known(std::uint16_t type) {
  return type >= static_cast<std::uint16_t>(MessageType::kStatusRequest) &&
         type <= static_cast<std::uint16_t>(MessageType::kReportReply) && type != kRetiredType;
}

tl::unexpected<Error> refuse(const std::string& field, const std::string& detail) {
  return fail(ErrorCode::kProtocol, "frame " + field + ": " + detail);
}

}  // namespace

std::string encode_frame(MessageType type, std::uint64_t request_id, std::string_view payload) {
  assert(payload.size() <= kMaxPayloadBytes);
  std::string frame;
  frame.reserve(kHeaderBytes + payload.size());
  frame.append(kMagic);
  append_little_endian(frame, kVersion);
  append_little_endian(frame, static_cast<std::uint16_t>(type));
  append_little_endian(frame, static_cast<std::uint32_t>(payload.size()));
  append_little_endian(frame, std::uint32_t{0});
  append_little_endian(frame, request_id);
  const std::uint32_t crc = crc_of(frame, payload);
  for (std::size_t i = 0; i < sizeof crc; ++i) {
    frame[kCrcOffset + i] = static_cast<char>((crc >> (8 * i)) & 0xffu);
  }
  frame.append(payload);
  return frame;
}

Result<Frame> decode_frame(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) {
    return refuse("header", std::to_string(bytes.size()) + " bytes, must be at least " +
                                std::to_string(kHeaderBytes));
  }
  if (bytes.substr(0, kMagic.size()) != kMagic) return refuse("magic", "must be \"BSFT\"");
  const auto version = read_little_endian<std::uint16_t>(bytes, kVersionOffset);
  if (version != kVersion) {
    return refuse("version", std::to_string(version) + ", must be " + std::to_string(kVersion));
  }
  const auto type = read_little_endian<std::uint16_t>(bytes, kTypeOffset);
  if (!is_known(type)) return refuse("type", std::to_string(type) + " is unknown");
  const auto size = read_little_endian<std::uint32_t>(bytes, kSizeOffset);
  if (size > kMaxPayloadBytes) {
    return refuse("payload size", std::to_string(size) + " bytes, must be at most " +
                                      std::to_string(kMaxPayloadBytes));
  }
  const std::string_view payload = bytes.substr(kHeaderBytes);
  if (payload.size() != size) {
    return refuse("payload size", std::to_string(size) + " bytes stated, " +
                                      std::to_string(payload.size()) + " received");
  }
  if (crc_of(bytes.substr(0, kHeaderBytes), payload) !=
      read_little_endian<std::uint32_t>(bytes, kCrcOffset)) {
    return refuse("CRC-32", "does not match the message");
  }
  return Frame{static_cast<MessageType>(type),
               read_little_endian<std::uint64_t>(bytes, kRequestIdOffset), payload};
}

}  // namespace brainshift::wire
