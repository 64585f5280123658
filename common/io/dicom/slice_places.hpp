// SPDX-License-Identifier: GPL-3.0-or-later
// Whether images lie behind each other along their normal, as the slices of a volume must: the rule
// of a series and of a segmentation's frames.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// How far an image's position may lie from where the others ask it to lie, mm.
inline constexpr double kLargestSliceError_mm = 0.05;

struct SlicePlace {
  std::string name;
  Vec3 position = Vec3::Zero();  // ImagePositionPatient (0020,0032): LPS, mm
};

// "b.dcm at (-24, -100, 50)".
std::string place_text(const SlicePlace& place);

// kUnreadable: most images lie on a line and one beside it (told by how much), or the line is
// tilted against the normal (told by how many degrees). Precondition: not empty.
Status check_slice_line(const std::vector<SlicePlace>& places, const Vec3& normal);

}  // namespace brainshift::io
