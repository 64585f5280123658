// SPDX-License-Identifier: GPL-3.0-or-later
// Names of transforms as PLUS and 3D Slicer write them: "ProbeToTracker" maps coordinates from Probe to Tracker.
//
// A frame's name begins with a capital letter; the "To" between two names is followed by one. A name in which more than
// one "To" could be the link ("ArmToToolToTracker") says no pair of frames.
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

// kInvalidArgument naming the text.
Result<FramePair> parse_transform_name(std::string_view name);

// Frames of pixels: "Image" and names that end in it ("CroppedImage"). A link from or to one may scale (pixels to mm);
// every other link is a rigid motion.
bool is_image_frame(std::string_view frame);

}  // namespace brainshift::tracking
