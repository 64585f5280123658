// SPDX-License-Identifier: GPL-3.0-or-later
// The transform from one frame to another for every image of a recording, through its tracked
// links and constant ones.
//
//   T_target_source(i) = T_n ... T_2 T_1,  every tracked T_k at the time time_s[i] - latency_s
//
// latency_s: by how much an image's stamp is later than the moment it shows. The tracker's clock
// is the reference. Without a latency a frame's own sample decides, whatever the times are; only
// where the frame has none are its neighbours in time asked. A frame has no transform when its
// image or any link is not valid at that time; the result says why.
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
  double latency_s = 0.0;  // -1 to 1, s
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
  std::vector<std::string> why_not;  // per frame, why it has no transform; else empty
  std::vector<std::string> links;    // names, in walking order
  int used = 0;
  std::vector<Dropped> dropped;
};

// constants and the recording's links together name the frames; source and target are two of them.
// kInvalidArgument: no chain (transform_graph.hpp), an option out of range (named), or a latency
// where two frames of one time have different poses.
Result<Chain> evaluate_chain(const Recording& recording, const std::vector<ConstantLink>& constants,
                             const std::string& source, const std::string& target,
                             const ChainOptions& options = {});

// Counts a frame in the entry of that reason, which is made when it is missing.
void count_dropped(std::vector<Dropped>& dropped, const std::string& reason, int frame);

}  // namespace brainshift::tracking
