// SPDX-License-Identifier: Apache-2.0
// The 58 bytes that begin every OpenIGTLink message (big-endian):
//   offset  size  field
//        0     2  header version   1, or 2: the body then has an extended header and metadata
//        2    12  type             ASCII, padded with NUL
//       14    20  device name      ASCII, padded with NUL
//       34     8  timestamp        seconds since 1970 UTC, 32.32 fixed point; 0: none
//       42     8  body size        bytes after the header
//       50     8  CRC-64           of the body (crc64.hpp)
// The CRC does not cover the header. A damaged name or timestamp passes unnoticed.
//
// Source: the protocol's description, Documents/Protocol/header.md and timestamp.md of
// github.com/openigtlink/OpenIGTLink. Its protocol versions 1 and 2 have header version 1; its
// protocol version 3 has header version 2.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::igtl {

inline constexpr std::size_t kHeaderBytes = 58;
inline constexpr std::size_t kMaxTypeBytes = 12;
inline constexpr std::size_t kMaxDeviceBytes = 20;

// A point in time as the header has it: 2^-32 seconds since 1970 UTC. 0 means none.
using Timestamp = std::uint64_t;

// Rounds up to the next 2^-32 s (0.23 ns), so that to_nanoseconds gives the same number back.
// Precondition: since_1970 is from 0 to the year 2106, where the seconds overflow.
Timestamp to_timestamp(std::chrono::nanoseconds since_1970);
std::chrono::nanoseconds to_nanoseconds(Timestamp timestamp);

struct Header {
  std::uint16_t version = 1;
  std::string type;    // "IMAGE"
  std::string device;  // up to the first NUL
  Timestamp timestamp = 0;
  std::uint64_t body_bytes = 0;
  std::uint64_t crc = 0;

  friend bool operator==(const Header&, const Header&) = default;
};

// kInvalidArgument: a version other than 1 and 2, an empty type, a type or device name that is too
// long or holds a control character.
Status validate(const Header& header);

// kHeaderBytes bytes. Precondition: validate(header).
std::string encode_header(const Header& header);

// The first kHeaderBytes of `bytes`. kProtocol where they cannot be a header, as after a stream got
// out of step: fewer bytes, what validate() refuses, or a type that is not printable ASCII.
Result<Header> decode_header(std::string_view bytes);

// kProtocol where the checksum of the body that came is not the header's.
Status check_crc(const Header& header, std::uint64_t crc_of_body);

}  // namespace brainshift::igtl
