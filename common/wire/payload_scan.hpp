// SPDX-License-Identifier: Apache-2.0
// A walk over the Protobuf wire format before anything is allocated, and the parse behind it.
// Private to common/wire.
//
// Protobuf's parser allocates as it reads: two bytes of an empty submessage become a heap object,
// so 10 MB become 227 MB. It also accepts concatenated messages (the last value wins) and fields
// of the wrong wire type (they become unknown fields).
// The walk follows the message's descriptor and counts fields and numbers. It stops at the first
// thing that is malformed or above a cap. Until then it allocates nothing.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::wire {

// An update with 8,000 iterations of history has about 64,000 fields; packed numbers count as one.
inline constexpr int kMaxFields = 1 << 16;
// Numbers in all packed fields of a payload together: 64 MiB of 4-byte floats. A byte of a `bytes`
// field counts as one.
inline constexpr std::size_t kMaxNumbers = std::size_t{1} << 24;
// Bytes of one text field.
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 16;

// Ok if `payload` is one well-formed message of `type` within the caps. Otherwise kProtocol with
// the name of the field.
Status scan(const google::protobuf::Descriptor& type, std::string_view payload);

// scan, then parse.
Status parse(std::string_view payload, google::protobuf::Message& message);

}  // namespace brainshift::wire
