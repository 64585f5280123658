// SPDX-License-Identifier: GPL-3.0-or-later
// Which links lead from one named frame to another.
//
// Frames are the nodes, links the edges; a link can be walked against its direction with the inverse transform. The path is
// a shortest one (breadth first); among several, the one whose links were added first.
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

// Steps in walking order: the first leaves `from`. Empty when from == to. kInvalidArgument: a frame that no link names, or
// frames that are not connected; the sentence lists the frames that can be reached and the others. Two links between the
// same two frames are refused, since they may disagree.
Result<std::vector<ChainStep>> shortest_chain(const std::vector<FramePair>& links,
                                              const std::string& from, const std::string& to);

}  // namespace brainshift::tracking
