// SPDX-License-Identifier: GPL-3.0-or-later
// The transform from one frame to another for every image of a recording, through its tracked links and constant ones.
//
//   T_target_source(i) = T_n ... T_2 T_1,  every tracked T_k at the time time_s[i] - latency_s
//
// latency_s: how much later an image was stamped than its tissue was seen; the tracker's clock is the reference. A frame
// whose image or any link is not valid at that time has no transform, and the report says why.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/tracking/pose_interpolation.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::tracking {

struct ConstantLink {
  FramePair frames;
  AffineTransform T_to_from = AffineTransform::Identity();
};

struct ChainOptions {
  double latency_s = 0.0;  // -1 to 1
  PoseTimeOptions time;
};

// Frames left out for one reason.
struct Dropped {
  std::string reason;  // "ProbeToTracker is invalid"
  int count = 0;
  int first_frame = 0;
};

struct Chain {
  std::vector<std::optional<AffineTransform>> T_target_source;  // per frame of the recording
  std::vector<std::string> why_not;  // per frame, why it has none; else empty
  std::vector<std::string> links;    // names, in walking order
  int used = 0;
  std::vector<Dropped> dropped;
};

// kInvalidArgument: no chain (transform_graph.hpp), or options out of range; the sentence names them.
Result<Chain> evaluate_chain(const Recording& recording, const std::vector<ConstantLink>& constants,
                             const std::string& source, const std::string& target,
                             const ChainOptions& options = {});

// Adds a frame to the entry of that reason.
void count_dropped(std::vector<Dropped>& dropped, const std::string& reason, int frame);

}  // namespace brainshift::tracking
