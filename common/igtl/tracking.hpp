// SPDX-License-Identifier: Apache-2.0
// TRANSFORM and TDATA: where something is, as an affine transform.
//
// TRANSFORM, 48 bytes: twelve float32, the columns of [R | t], R first; t in mm.
// TDATA, 70 bytes for each tool: name (20 bytes, padded with NUL), type (1 byte), reserved (1 byte,
// 0), and a transform as above.
// Frames: the device name says what the transform maps to what ("ProbeToReference"); of TDATA, the
// name of the tool. Neither message says whether the tool was seen: PlusServer says so in the
// metadata TransformStatus of a version 2 TRANSFORM.
// Source: Documents/Protocol/transform.md, trackingdata.md of github.com/openigtlink/OpenIGTLink.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::igtl {

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

}  // namespace brainshift::igtl
