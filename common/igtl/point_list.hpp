// SPDX-License-Identifier: Apache-2.0
// POINT: named points, for instance the markups of 3D Slicer. 136 bytes each (big-endian):
//   offset  size  field
//        0    64  name       padded with NUL
//       64    32  group      "Fiducial", "Landmark", ...
//       96   4*1  colour     red, green, blue, opacity; 0 to 255
//      100   3*4  position   float32, mm
//      112     4  diameter   float32, mm; may be 0
//      116    20  owner      device name of the image that the point belongs to
// Source: Documents/Protocol/point.md of github.com/openigtlink/OpenIGTLink.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::igtl {

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
