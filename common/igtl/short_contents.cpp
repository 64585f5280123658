// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/short_contents.hpp"

#include "common/igtl/bytes.hpp"
#include "common/igtl/header.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kTextHeaderBytes = 4;
constexpr std::size_t kErrorNameBytes = 20;
constexpr std::size_t kStatusHeaderBytes = 2 + 8 + kErrorNameBytes;

}  // namespace

Status validate(const Text& text) {
  if (text.text.size() > Text::kMaxBytes) {
    return invalid("text has " + std::to_string(text.text.size()) + " bytes, must have at most " +
                   std::to_string(Text::kMaxBytes));
  }
  return {};
}

Status validate(const StatusReport& report) {
  if (Status status = check_padded("error name", report.error_name, kErrorNameBytes); !status) {
    return status;
  }
  return check_padded("text", report.text, StatusReport::kMaxTextBytes);
}

Status validate(const Capability& capability) {
  for (const std::string& type : capability.types) {
    if (type.empty()) return invalid("a message type is empty");
    if (Status status = check_padded("message type", type, kMaxTypeBytes); !status) return status;
  }
  return {};
}

void append_content(const Text& text, std::string& out) {
  append_number(out, text.encoding);
  append_number(out, static_cast<std::uint16_t>(text.text.size()));
  out.append(text.text);
}

void append_content(const StatusReport& report, std::string& out) {
  append_number(out, report.code);
  append_number(out, report.subcode);
  append_padded(out, report.error_name, kErrorNameBytes);
  out.append(report.text).push_back('\0');
}

void append_content(const Capability& capability, std::string& out) {
  for (const std::string& type : capability.types) append_padded(out, type, kMaxTypeBytes);
}

Result<Text> decode_text(std::string_view content) {
  if (content.size() < kTextHeaderBytes) {
    return malformed(std::to_string(content.size()) + " bytes, must be at least " +
                     std::to_string(kTextHeaderBytes));
  }
  ByteReader reader(content);
  Text text;
  text.encoding = reader.number<std::uint16_t>();
  const auto bytes = reader.number<std::uint16_t>();
  if (bytes != reader.left()) {
    return malformed("text of " + std::to_string(bytes) + " bytes, " +
                     std::to_string(reader.left()) + " are left");
  }
  text.text = reader.rest();
  return text;
}

Result<StatusReport> decode_status_report(std::string_view content) {
  if (content.size() < kStatusHeaderBytes) {
    return malformed(std::to_string(content.size()) + " bytes, must be at least " +
                     std::to_string(kStatusHeaderBytes));
  }
  ByteReader reader(content);
  StatusReport report;
  report.code = reader.number<std::uint16_t>();
  report.subcode = reader.number<std::int64_t>();
  report.error_name = reader.take_padded(kErrorNameBytes);
  report.text = reader.take_padded(reader.left());
  if (const Status status = validate(report); !status) return malformed(status.error().message);
  return report;
}

Result<Capability> decode_capability(std::string_view content) {
  if (content.size() % kMaxTypeBytes != 0) {
    return malformed(std::to_string(content.size()) + " bytes, must be a multiple of " +
                     std::to_string(kMaxTypeBytes));
  }
  Capability capability;
  for (ByteReader reader(content); reader.left() > 0;) {
    capability.types.emplace_back(reader.take_padded(kMaxTypeBytes));
  }
  if (const Status status = validate(capability); !status) return malformed(status.error().message);
  return capability;
}

}  // namespace brainshift::igtl
