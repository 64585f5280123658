// SPDX-License-Identifier: GPL-3.0-or-later
// Which links lead from one named frame to another.
//
// Frames are the nodes, links the edges. A link can be walked against its direction with the
// inverse transform. The path is a shortest one (breadth first); among several, the one whose
// links come first in the list.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/tracking/transform_name.hpp"

namespace brainshift::tracking {

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
