// SPDX-License-Identifier: GPL-3.0-or-later
// What `brainshift register --ultrasound` did, to be judged by eye: two ultrasound frames that
// cross, beside the MRI in the plane of each frame before and after, and the chain of frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/tracking/recording.hpp"
#include "common/ultrasound/frame_samples.hpp"

namespace brainshift::client {

struct RegisteredUltrasound {
  const tracking::Recording& recording;
  const ultrasound::ImagePoses& poses;  // T_reference_image of the frames used
  const VoxelImage& mri;
  const TriangleSurface* tumour = nullptr;                                   // RAS; may be missing
  Vec3 target = Vec3::Zero();                                                // RAS
  RigidTransform T_before = RigidTransform::Identity(), T_after = T_before;  // T_ras_reference
  std::vector<std::string> links = {};  // names, from the image to RAS
  std::string title = {}, subtitle = {};
};

// The bytes of a PNG file. kInternal; `name` is the file's, for the message. Precondition: a frame
// has a pose.
Result<std::string> registration_png(const std::string& name, const RegisteredUltrasound& done);

// The frame whose plane passes nearest to the target, with the target before it; and of those whose
// plane crosses it at 30 degrees or more the nearest, if there is one. Precondition as above.
struct CrossingFrames {
  int first = 0;
  std::optional<int> second;
};
CrossingFrames crossing_frames(const tracking::Recording& recording,
                               const ultrasound::ImagePoses& poses, const Vec3& target_reference);

}  // namespace brainshift::client
