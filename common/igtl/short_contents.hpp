// SPDX-License-Identifier: Apache-2.0
// The messages of a few texts, transforms or points (big-endian).
//
// STRING: uint16 encoding (MIBenum of IANA), uint16 bytes of the text, the text.
// STATUS: uint16 code, int64 subcode, name of the error (20 bytes, padded with NUL), and a text
// that ends with NUL.
// CAPABILITY: names of message types, 12 bytes each, padded with NUL.
// GET_STATUS, GET_CAPABIL: no content.
//
// TRANSFORM, 48 bytes: twelve float32, the columns of [R | t], R first; t in mm.
// TDATA, 70 bytes for each tool: name (20 bytes, padded with NUL), type (1 byte), reserved (1 byte,
// 0), and a transform as above.
// Frames: the device name says what the transform maps to what ("ProbeToReference"); of TDATA, the
// name of the tool. Neither message says whether the tool was seen: PlusServer says so in the
// metadata TransformStatus of a version 2 TRANSFORM.
//
// POINT: named points, for instance the markups of 3D Slicer. 136 bytes each:
//   offset  size  field
//        0    64  name       padded with NUL
//       64    32  group      "Fiducial", "Landmark", ...
//       96   4*1  colour     red, green, blue, opacity; 0 to 255
//      100   3*4  position   float32, mm
//      112     4  diameter   float32, mm; may be 0
//      116    20  owner      device name of the image that the point belongs to
//
// Source: Documents/Protocol/string.md, status.md, capability.md, query.md, transform.md,
// trackingdata.md, point.md of github.com/openigtlink/OpenIGTLink.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
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

// ---- TRANSFORM, TDATA ----

// [R | t] in single precision, as the messages have it.
using Matrix34f = Eigen::Matrix<float, 3, 4>;

// 4 x 4 with the last row 0 0 0 1. common/core/rigid_motion.hpp checks whether it is a motion.
Eigen::Matrix4d to_matrix(const Matrix34f& transform);

struct Transform {
  static constexpr std::string_view kType = "TRANSFORM";
  Matrix34f matrix = Matrix34f::Identity();
  friend bool operator==(const Transform&, const Transform&) = default;
};

enum class ToolType : std::uint8_t { kTracker = 1, k6d = 2, k3d = 3, k5d = 4 };

struct TrackedTool {
  std::string name;
  ToolType type = ToolType::k6d;
  Matrix34f matrix = Matrix34f::Identity();
  friend bool operator==(const TrackedTool&, const TrackedTool&) = default;
};

struct TrackingData {
  static constexpr std::string_view kType = "TDATA";
  std::vector<TrackedTool> tools;
  friend bool operator==(const TrackingData&, const TrackingData&) = default;
};

// kNotFinite: an entry of a matrix. kInvalidArgument: a name of more than 20 bytes.
Status validate(const Transform& transform);
Status validate(const TrackingData& data);

// Precondition: validate().
void append_content(const Transform& transform, std::string& out);
void append_content(const TrackingData& data, std::string& out);

// kProtocol: another size, an unknown tool type, an entry that is not finite.
Result<Transform> decode_transform(std::string_view content);
Result<TrackingData> decode_tracking_data(std::string_view content);

// ---- POINT ----

struct NamedPoint {
  std::string name;   // up to 64 bytes
  std::string group;  // up to 32 bytes
  std::array<std::uint8_t, 4> rgba{255, 255, 255, 255};
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float diameter = 0.0F;
  std::string owner;  // up to 20 bytes

  friend bool operator==(const NamedPoint&, const NamedPoint&) = default;
};

struct PointList {
  static constexpr std::string_view kType = "POINT";
  std::vector<NamedPoint> points;
  friend bool operator==(const PointList&, const PointList&) = default;
};

// kInvalidArgument: a text that is too long or holds a NUL. kNotFinite: a position or diameter.
Status validate(const PointList& list);

// Precondition: validate().
void append_content(const PointList& list, std::string& out);

// kProtocol: a size that is no multiple of 136, or a number that is not finite.
Result<PointList> decode_point_list(std::string_view content);

}  // namespace brainshift::igtl
