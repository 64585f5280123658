// SPDX-License-Identifier: GPL-3.0-or-later
// Names of transforms as PLUS and 3D Slicer write them: "ProbeToTracker" maps coordinates from
// Probe to Tracker.
//
// A frame's name begins with a capital letter, so a capital follows the "To" between two names. A
// name in which more than one "To" could be the link ("ArmToToolToTracker") is ambiguous and
// rejected.
#pragma once

#include <string>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::tracking {

// x_to = T_to_from x_from.
struct FramePair {
  std::string from;
  std::string to;

  std::string name() const { return from + "To" + to; }
};

// kInvalidArgument: no pair of frames, or an ambiguous one; the sentence quotes the name.
Result<FramePair> parse_transform_name(std::string_view name);

// Frames of pixels: "Image" and names that end in it ("CroppedImage"). A link from or to such a
// frame may scale (pixels to mm); every other link is a rigid motion.
bool is_image_frame(std::string_view frame);

}  // namespace brainshift::tracking
