// SPDX-License-Identifier: Apache-2.0
// Bytes in, as they arrive from a connection; whole messages out.
//
// Nothing in a header takes memory: a body grows as its bytes arrive, by doubling, up to the limit
// of its type. A message whose type is not wanted is not kept at all: its bytes are counted, put
// into the CRC and dropped.
//
// What cannot be a message ends the stream: a header that is impossible (decode_header), a body
// above its limit, or a wrong CRC. Message boundaries are lost then, so the connection is to be
// closed. A body that is well framed but nonsense is decode()'s to refuse; the stream goes on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/igtl/header.hpp"

namespace brainshift::igtl {

struct StreamLimits {
  // Types to keep; the others are skipped. Empty: every type that decode() knows.
  std::set<std::string, std::less<>> wanted{};
  // Bytes of a body of IMAGE, POLYDATA and POINT with its metadata. An ultrasound frame has about
  // 1 MB, a model of 100,000 triangles 3 MB, and a brain of 256^3 voxels in int16 34 MB.
  std::uint64_t body_bytes = 64u << 20;
  // Of the types that are small by nature (STRING, STATUS, TRANSFORM, TDATA, ...): the longest text
  // and the longest metadata fit.
  std::uint64_t small_body_bytes = 256u << 10;
  // Of a message that is skipped. More is an attack or a stream out of step.
  std::uint64_t skipped_bytes = 1u << 30;

  // The limit for messages of this type that are kept.
  std::uint64_t limit_of(std::string_view type) const;
  bool is_wanted(std::string_view type) const;
};

// A message whose size and CRC are right.
struct Packet {
  Header header;
  bool skipped = false;  // not wanted: the body was dropped
  std::string body;
};

class StreamReader {
 public:
  explicit StreamReader(StreamLimits limits = {});

  // Takes bytes from the front of `bytes`, up to the end of the next message. Returns that message,
  // or nothing when `bytes` is used up before. Call it until `bytes` is empty.
  // kProtocol: the stream is broken; every later call returns the same error.
  Result<std::optional<Packet>> read(std::string_view& bytes);

  // Memory held for the message that is arriving.
  std::size_t held_bytes() const;

 private:
  Status begin_body();
  void take_body(std::string_view& bytes);
  tl::unexpected<Error> give_up(const Error& error);

  StreamLimits limits_;
  std::string header_bytes_;
  std::optional<Packet> packet_;  // while its body arrives
  std::uint64_t received_ = 0;    // bytes of its body
  std::uint64_t crc_ = 0;         // of those
  std::optional<Error> broken_;
};

}  // namespace brainshift::igtl
