// SPDX-License-Identifier: Apache-2.0
// Framing: one message = one ZeroMQ frame = header + Protobuf payload.
//
// Protobuf alone accepts truncated and concatenated input, so every payload is framed:
//   offset  size  field        (little-endian)
//        0     4  magic        "BSFT"
//        4     2  version      2
//        6     2  type         MessageType
//        8     4  payload size bytes, <= kMaxPayloadBytes
//       12     4  CRC-32       of all other bytes: 0-11, 16-23, the payload (zlib polynomial)
//       16     8  request id   chosen by the client, echoed in the reply; 0 for pushed updates
// decode_frame rejects anything else: kProtocol, with the name of the header's field. (Version 1
// left the header out of its CRC.)
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::wire {

enum class MessageType : std::uint16_t {
  kStatusRequest = 1,
  kStatusReply = 2,
  kStartSessionRequest = 3,
  kStartSessionReply = 4,
  kModelRequest = 5,
  kModelReply = 6,
  kSubscribeRequest = 7,
  // 8 was version 1's reply to a subscription
  kObservation = 9,
  kObservationReply = 10,
  kErrorReply = 11,
  kUpdate = 12,
  kSessionState = 13,
  kReportRequest = 14,
  kReportReply = 15,
};

inline constexpr std::size_t kHeaderBytes = 24;
inline constexpr std::uint16_t kVersion = 2;
// 100k nodes need about 2 MiB per update and 8 MiB per model. Anything near the cap is an attack
// or a bug.
inline constexpr std::size_t kMaxPayloadBytes = 64u << 20;

struct Frame {
  MessageType type = MessageType::kStatusRequest;
  std::uint64_t request_id = 0;
  std::string_view payload;  // view into the decoded bytes
};

// Header + payload in one buffer. Precondition: payload.size() <= kMaxPayloadBytes. It is
// asserted, and a peer rejects anything larger, so a caller checks the size of what grows with the
// mesh.
std::string encode_frame(MessageType type, std::uint64_t request_id, std::string_view payload);

// Fails with kProtocol on wrong magic, version, type, length, CRC, or an oversized payload.
Result<Frame> decode_frame(std::string_view bytes);

}  // namespace brainshift::wire
