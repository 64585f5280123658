// SPDX-License-Identifier: Apache-2.0
#include "common/wire/payload_scan.hpp"

#include <algorithm>
#include <cstdint>

#include "common/core/text.hpp"
#include "common/wire/frame.hpp"

namespace brainshift::wire {
namespace {

namespace gp = google::protobuf;

// Wire types of the Protobuf encoding; groups (3, 4) are obsolete and rejected.
enum WireType : std::uint32_t { kVarint = 0, kFixed64 = 1, kLength = 2, kFixed32 = 5 };
constexpr int kMaxDepth = 8;  // deeper than any message

bool take_varint(std::string_view& bytes, std::uint64_t& value) {
  value = 0;
  for (int shift = 0; shift < 64 && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    value |= static_cast<std::uint64_t>(byte & 0x7fu) << shift;
    if ((byte & 0x80u) == 0) return true;
  }
  return false;
}

bool take(std::string_view& bytes, std::uint64_t count, std::string_view& taken) {
  if (count > bytes.size()) return false;
  taken = bytes.substr(0, count);
  bytes.remove_prefix(count);
  return true;
}

// Wire type of one value of the field.
WireType value_wire_type(const gp::FieldDescriptor& field) {
  switch (field.type()) {
    case gp::FieldDescriptor::TYPE_DOUBLE:
    case gp::FieldDescriptor::TYPE_FIXED64:
    case gp::FieldDescriptor::TYPE_SFIXED64: return kFixed64;
    case gp::FieldDescriptor::TYPE_FLOAT:
    case gp::FieldDescriptor::TYPE_FIXED32:
    case gp::FieldDescriptor::TYPE_SFIXED32: return kFixed32;
    case gp::FieldDescriptor::TYPE_STRING:
    case gp::FieldDescriptor::TYPE_BYTES:
    case gp::FieldDescriptor::TYPE_MESSAGE: return kLength;
    default: return kVarint;
  }
}

std::size_t count_packed(WireType type, std::string_view bytes) {
  if (type == kFixed64) return bytes.size() / 8;
  if (type == kFixed32) return bytes.size() / 4;
  return static_cast<std::size_t>(std::count_if(bytes.begin(), bytes.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0x80u) == 0;
  }));
}

template <typename Count>
std::string more_than(Count limit, std::string_view things) {
  std::string text = "more than ";
  text.append(std::to_string(limit)).append(things);
  return text;
}

class Scanner {
 public:
  Status message(const gp::Descriptor& type, std::string_view bytes, int depth) {
    if (depth > kMaxDepth) return refuse(type.name(), "nested too deeply");
    std::uint64_t seen = 0;  // bit per singular field, or per oneof
    while (!bytes.empty()) {
      std::uint64_t tag = 0;
      if (!take_varint(bytes, tag) || tag > UINT32_MAX || (tag >> 3) == 0) {
        return refuse(type.name(), "malformed field tag");
      }
      if (++fields_ > kMaxFields) return refuse(type.name(), more_than(kMaxFields, " fields"));
      const auto wire = static_cast<WireType>(tag & 7u);
      const gp::FieldDescriptor* field = type.FindFieldByNumber(static_cast<int>(tag >> 3));
      std::string_view value;
      if (!take_value(bytes, wire, value)) {
        return refuse(field ? field->full_name() : type.name(), "truncated or malformed value");
      }
      if (field == nullptr) continue;  // from a newer minor version; counted above
      if (Status status = known_field(*field, wire, value, seen, depth); !status) return status;
    }
    return {};
  }

 private:
  static Status refuse(const std::string& field, const std::string& detail) {
    return fail(ErrorCode::kProtocol, "payload " + field + ": " + detail);
  }

  static bool take_value(std::string_view& bytes, WireType wire, std::string_view& value) {
    std::uint64_t number = 0;
    switch (wire) {
      case kVarint: return take_varint(bytes, number);
      case kFixed64: return take(bytes, 8, value);
      case kFixed32: return take(bytes, 4, value);
      case kLength: return take_varint(bytes, number) && take(bytes, number, value);
    }
    return false;
  }

  Status known_field(const gp::FieldDescriptor& field, WireType wire, std::string_view value,
                     std::uint64_t& seen, int depth) {
    const WireType expected = value_wire_type(field);
    const bool packed = field.is_packable() && wire == kLength;
    if (wire != expected && !packed) return refuse(field.full_name(), "wrong wire type");
    if (!field.is_repeated()) {
      const auto* oneof = field.real_containing_oneof();
      const int slot = oneof ? oneof->field(0)->index() : field.index();
      const std::uint64_t bit = std::uint64_t{1} << (slot & 63);
      if ((seen & bit) != 0) return refuse(field.full_name(), "occurs more than once");
      seen |= bit;
    }
    const bool bytes = field.type() == gp::FieldDescriptor::TYPE_BYTES;
    if (packed || bytes) {
      if (expected == kFixed64 && value.size() % 8 != 0)
        return refuse(field.full_name(), "truncated");
      if (expected == kFixed32 && value.size() % 4 != 0)
        return refuse(field.full_name(), "truncated");
      numbers_ += bytes ? value.size() : count_packed(expected, value);
      if (numbers_ > kMaxNumbers) {
        return refuse(field.full_name(), more_than(kMaxNumbers, " numbers in one payload"));
      }
      return {};
    }
    if (field.cpp_type() == gp::FieldDescriptor::CPPTYPE_MESSAGE) {
      return message(*field.message_type(), value, depth + 1);
    }
    if (field.cpp_type() == gp::FieldDescriptor::CPPTYPE_STRING) {
      if (value.size() > kMaxTextBytes) {
        return refuse(field.full_name(), std::to_string(value.size()) + " bytes, must be at most " +
                                             std::to_string(kMaxTextBytes));
      }
      // The parser would reject it too, but it writes to stderr.
      if (!is_utf8(value)) return refuse(field.full_name(), "is not UTF-8");
    }
    return {};
  }

  int fields_ = 0;
  std::size_t numbers_ = 0;
};

}  // namespace

Status scan(const gp::Descriptor& type, std::string_view payload) {
  if (payload.size() > kMaxPayloadBytes) {
    return fail(ErrorCode::kProtocol,
                "payload " + type.name() + ": " + std::to_string(payload.size()) +
                    " bytes, must be at most " + std::to_string(kMaxPayloadBytes));
  }
  return Scanner().message(type, payload, 0);
}

Status parse(std::string_view payload, gp::Message& message) {
  if (Status status = scan(*message.GetDescriptor(), payload); !status) return status;
  // kMaxPayloadBytes fits an int.
  if (!message.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) {
    return fail(ErrorCode::kProtocol,
                "payload " + message.GetDescriptor()->name() + ": cannot be parsed");
  }
  return {};
}

}  // namespace brainshift::wire
