// SPDX-License-Identifier: GPL-3.0-or-later
// The options of ImageRegistrar (image_registration.hpp), and the checks of its input. Every error
// names the value.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::registration {

struct ImageLevel {
  double smoothing_mm = 0.0;  // standard deviation, of M
  int samples = 0;            // about this many are used
};

struct ImageRegistrationOptions {
  // Coarse to fine. With 40000 ultrasound samples the pose differs by less than 0.1 mm from that
  // with 20000.
  std::vector<ImageLevel> levels = {{3.0, 4000}, {2.0, 8000}, {1.0, 20000}};
  int bins = 32;  // of each intensity, 8 to 256
  // Intensities below and above these quantiles count as equal to them.
  double low_quantile = 0.005, high_quantile = 0.995;
  // Of the six further starting poses; 0: only the given pose.
  double start_offset_mm = 4.0;
  int max_iterations = 60;  // per level and start
  // A registration by fiducials errs by up to 5 mm (paper 2.7). A correction beyond these limits
  // does not correct such an error.
  double max_translation_mm = 15.0;  // of the samples' centroid
  double max_rotation_deg = 15.0;
  double min_overlap = 0.5;  // fraction of the samples inside the MRI
  // Starts whose poses agree within this belong together: rms over the samples, before the finest
  // level.
  double same_pose_mm = 2.0;
};

Status check_options(const ImageRegistrationOptions& options);

// what: "MRI" or "region", for the sentence.
Status check_image(const char* what, const VoxelImage& image);

Status check_samples(const IntensitySamples& samples);

}  // namespace brainshift::registration
