// SPDX-License-Identifier: Apache-2.0
// What header version 2 adds to the body of a message: extended header | content | metadata header
// | metadata. Version 1: the body is the content.
//
// Extended header, 12 bytes (big-endian):
//   offset  size  field
//        0     2  size of the extended header    12; a reader skips what a longer one adds
//        2     2  size of the metadata header    2 + 8 * entries
//        4     4  size of the metadata
//        8     4  message id                     chosen by the sender
// Metadata header: 2 bytes number of entries, and for each of them 2 bytes size of the key, 2 bytes
// encoding of the value, 4 bytes size of the value. Metadata: key and value of every entry, in the
// same order, without a separator.
//
// Source: Documents/Protocol/header.md of github.com/openigtlink/OpenIGTLink.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::igtl {

// MIBenum of IANA's character sets.
inline constexpr std::uint16_t kUsAscii = 3;
inline constexpr std::uint16_t kUtf8 = 106;

// Of all keys and values together. The protocol allows 32 bits, but the readers of OpenIGTLink 3
// (igtlMessageBase.cxx, UnpackMetaData) hold the size in 16.
inline constexpr std::size_t kMaxMetadataBytes = 65535;
// 2 + 8 * entries fit into 16 bits.
inline constexpr std::size_t kMaxMetadataEntries = 8191;

struct MetadataEntry {
  std::string key;
  std::string value;
  std::uint16_t encoding = kUsAscii;

  friend bool operator==(const MetadataEntry&, const MetadataEntry&) = default;
};

using Metadata = std::vector<MetadataEntry>;

// Value of the first entry with this key; null where there is none.
const std::string* find(const Metadata& metadata, std::string_view key);

// kInvalidArgument: more than kMaxMetadataEntries entries or kMaxMetadataBytes bytes, an empty key,
// the same key twice.
Status validate(const Metadata& metadata);

// A body taken apart. `content` is a view into the body.
struct Body {
  std::string_view content;
  std::uint32_t message_id = 0;
  Metadata metadata;
};

// A body of header version 1 or 2. An empty one is empty in both versions. kProtocol: sizes that do
// not fit the body or each other. Memory is taken only for what the body holds.
Result<Body> decode_body(std::uint16_t version, std::string_view body);

// What stands before and after the content. Empty in version 1, which has neither a message id nor
// metadata. Precondition: validate(metadata).
struct BodyFrame {
  std::string before;
  std::string after;
};
BodyFrame encode_body_frame(std::uint16_t version, std::uint32_t message_id,
                            const Metadata& metadata);

}  // namespace brainshift::igtl
