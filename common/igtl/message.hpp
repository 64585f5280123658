// SPDX-License-Identifier: Apache-2.0
// A whole message: header, content of one of the known types, and with header version 2 a message
// id and metadata.
//
// Version 1 has neither a message id nor metadata: encode() leaves them out. So one envelope serves
// a receiver of version 1 and one of version 2.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "common/core/error.hpp"
#include "common/igtl/header.hpp"
#include "common/igtl/image.hpp"
#include "common/igtl/metadata.hpp"
#include "common/igtl/poly_data.hpp"
#include "common/igtl/short_contents.hpp"

namespace brainshift::igtl {

using Content = std::variant<Image, Transform, TrackingData, PolyData, PointList, Text,
                             StatusReport, StatusRequest, Capability, CapabilityRequest>;

// The message type of a content ("IMAGE").
std::string_view type_of(const Content& content);
// Whether decode() knows the type.
bool is_known_type(std::string_view type);

struct Envelope {
  std::uint16_t version = 1;
  std::string device;
  Timestamp timestamp = 0;
  std::uint32_t message_id = 0;
  Metadata metadata;

  friend bool operator==(const Envelope&, const Envelope&) = default;
};

struct Message {
  Envelope envelope;
  Content content;
};

// Replaces `out` by the bytes of the message. The capacity of `out` stays: a caller that sends
// messages of one size again and again keeps one string, and no memory is taken after the first.
// kInvalidArgument, kNotFinite: what validate() of header, metadata or content refuses, with the
// message's type in front; `out` is then empty.
Status encode(const Envelope& envelope, const Content& content, std::string& out);
// The same with voxels that stay where they are.
Status encode(const Envelope& envelope, const ImageView& image, std::string& out);

// The message of a header and of a body whose size and CRC were checked (StreamReader does).
// kProtocol: the type is unknown, or the body is not what its type says. The sentence names the
// type; the stream of messages is still in step.
Result<Message> decode(const Header& header, std::string_view body);

// One whole message and nothing else: header, size and CRC are checked, too.
Result<Message> decode(std::string_view bytes);

// The whole name of the message's device. Headers hold 20 bytes; PlusServer has a longer name in
// the metadata IGTL_DEVICE_NAME of version 2.
std::string full_device(const Envelope& envelope);
// Whether a device was meant by its whole name. Without metadata a longer one is known by its first
// 20 bytes alone.
bool is_named(const Envelope& envelope, std::string_view name);

// A tool of TDATA, whose whole name and validity stand in the metadata entry "<whole name>Status".
struct ToolState {
  std::string name;
  bool valid = true;  // OK; also without any such metadata, which other senders do not have
};
// Invalid when the metadata speak of other tools only, or of two whose names begin alike.
ToolState tool_state(const Envelope& envelope, std::string_view tool);

}  // namespace brainshift::igtl
