// SPDX-License-Identifier: GPL-3.0-or-later
// Links between named frames: their names, and which of them lead from one frame to another.
//
// PLUS and 3D Slicer call a link "ProbeToTracker" when it maps coordinates from Probe to Tracker.
// A frame's name begins with a capital letter, so a capital follows the "To" between two names. A
// name in which more than one "To" could be the link ("ArmToToolToTracker") is ambiguous and
// rejected.
//
// Frames are the nodes of a graph, links its edges. A link can be walked against its direction with
// the inverse transform. The path is a shortest one (breadth first); among several, the one whose
// links come first in the list.
#pragma once

#include <string>
#include <string_view>
#include <vector>

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

// links[link], walked from its `from` to its `to` or, inverted, the other way.
struct ChainStep {
  std::size_t link = 0;
  bool inverted = false;
};

// Steps in walking order: the first leaves `from`. Empty when from == to.
// kInvalidArgument: frames that are not connected, or a frame that no link names (the sentence
// lists the frames that can be reached, and the others); a link from a frame to itself; two links
// between the same two frames, since they may disagree.
Result<std::vector<ChainStep>> shortest_chain(const std::vector<FramePair>& links,
                                              const std::string& from, const std::string& to);

}  // namespace brainshift::tracking
