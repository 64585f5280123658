// SPDX-License-Identifier: Apache-2.0
// The short messages: STRING, STATUS, GET_STATUS, CAPABILITY and GET_CAPABIL (big-endian).
//
// STRING: uint16 encoding (MIBenum of IANA), uint16 bytes of the text, the text.
// STATUS: uint16 code, int64 subcode, name of the error (20 bytes, padded with NUL), and a text
// that ends with NUL.
// CAPABILITY: names of message types, 12 bytes each, padded with NUL.
// GET_STATUS, GET_CAPABIL: no content.
// Source: Documents/Protocol/string.md, status.md, capability.md, query.md of
// github.com/openigtlink/OpenIGTLink.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/igtl/metadata.hpp"

namespace brainshift::igtl {

struct Text {
  static constexpr std::string_view kType = "STRING";
  static constexpr std::size_t kMaxBytes = 65535;
  std::string text;
  std::uint16_t encoding = kUsAscii;
  friend bool operator==(const Text&, const Text&) = default;
};

// The codes that brainshift sends or looks at; status.md lists 1 to 19.
inline constexpr std::uint16_t kStatusOk = 1;
inline constexpr std::uint16_t kStatusNotReady = 13;

struct StatusReport {
  static constexpr std::string_view kType = "STATUS";
  static constexpr std::size_t kMaxTextBytes = 65535;  // as a STRING; the protocol names no limit
  std::uint16_t code = kStatusOk;
  std::int64_t subcode = 0;
  std::string error_name;  // up to 20 bytes
  std::string text;
  friend bool operator==(const StatusReport&, const StatusReport&) = default;
};

struct StatusRequest {
  static constexpr std::string_view kType = "GET_STATUS";
  friend bool operator==(const StatusRequest&, const StatusRequest&) = default;
};

struct Capability {
  static constexpr std::string_view kType = "CAPABILITY";
  std::vector<std::string> types;
  friend bool operator==(const Capability&, const Capability&) = default;
};

struct CapabilityRequest {
  static constexpr std::string_view kType = "GET_CAPABIL";
  friend bool operator==(const CapabilityRequest&, const CapabilityRequest&) = default;
};

// kInvalidArgument: a text that is too long. STATUS and CAPABILITY: a NUL in a text. CAPABILITY: an
// empty name.
Status validate(const Text& text);
Status validate(const StatusReport& report);
Status validate(const Capability& capability);
inline Status validate(const StatusRequest&) { return {}; }
inline Status validate(const CapabilityRequest&) { return {}; }

// Precondition: validate().
void append_content(const Text& text, std::string& out);
void append_content(const StatusReport& report, std::string& out);
void append_content(const Capability& capability, std::string& out);
inline void append_content(const StatusRequest&, std::string&) {}
inline void append_content(const CapabilityRequest&, std::string&) {}

// kProtocol: a size that does not fit, or what validate() refuses. A STATUS without the final NUL
// is read to its end, and what follows a NUL is left out.
Result<Text> decode_text(std::string_view content);
Result<StatusReport> decode_status_report(std::string_view content);
Result<Capability> decode_capability(std::string_view content);

}  // namespace brainshift::igtl
