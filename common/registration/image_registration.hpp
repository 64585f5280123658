// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid registration of an image given as samples, e.g. tracked ultrasound before the dura is opened, to the
// patient's MRI by normalised mutual information (paper 2.7): what is left of error after a registration by
// fiducials is taken out.
//
//   T_ras_ras = argmax over T  NMI(M(T x_i), I_i)                                       (image_similarity.hpp)
//
// Coarse to fine: on each level M is smoothed by a Gaussian and every k-th sample is used. On the coarsest level the
// search (pose_ascent.hpp) begins at the given pose and at six others, `start_offset_mm` from it along each axis;
// they are followed to the second finest level, and the best goes on to the finest.
// Mutual information asks only that intensities go together, not how: sulci may be dark in one image and bright in
// the other. Bins are of equal width, so intensities should not crowd at one end: ultrasound log-compressed, as
// displayed.
//
// Assumption: the tissue moved as a rigid body between the images, as it nearly does while the dura is closed.
// The optimum says nothing about whether the images show the same thing; `agreement` and the refusals below do.
// Sources: Ji, Wu, Hartov, Roberts & Paulsen, Med. Phys. 35 (2008), re-registration before durotomy; Studholme et
// al. 1999.
#pragma once

#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/intensity_samples.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::registration {

struct ImageLevel {
  double smoothing_mm = 0.0;  // standard deviation, of M
  int samples = 0;            // about so many are used
};

struct ImageRegistrationOptions {
  // Coarse to fine. 40000 ultrasound samples instead of 20000 change the pose by less than 0.1 mm.
  std::vector<ImageLevel> levels = {{3.0, 4000}, {2.0, 8000}, {1.0, 20000}};
  int bins = 32;  // of each intensity, 8 to 256
  // Intensities below and above these quantiles count as equal to them.
  double low_quantile = 0.005, high_quantile = 0.995;
  double start_offset_mm = 4.0;  // 0: only the given pose
  int max_iterations = 60;       // per level and start
  // A registration by fiducials errs by up to 5 mm (paper 2.7); a correction beyond this is none of its errors.
  double max_translation_mm = 15.0;  // of the samples' centroid
  double max_rotation_deg = 15.0;
  double min_overlap = 0.5;  // fraction of the samples inside the MRI
  // Starts whose poses agree within this belong together: rms over the samples, mm, before the finest level.
  double same_pose_mm = 2.0;
};

struct ImageRegistration {
  // The correction: x_ras (of the MRI) = T_ras_ras x_ras (as the samples are placed now).
  RigidTransform T_ras_ras = RigidTransform::Identity();
  double nmi_before = 0.0, nmi_after = 0.0;  // on the finest level
  double overlap = 0.0;                      // fraction of the samples inside the MRI at the end
  double shift_mm = 0.0;                     // of the samples' centroid
  double rotation_deg = 0.0;
  int iterations = 0;   // of all levels, along the best start's path
  int evaluations = 0;  // of NMI, of all starts
  bool converged = false;
  // Fraction of the starts that came to the pose taken. Low: the images have several ways to match. No pose that
  // half of the starts came to was wrong in the study (tests/sensing/reregistration_study.cpp); with less, have it
  // looked at.
  double agreement = 0.0;
};

// The MRI, smoothed for each level; set up once, used for any number of registrations. const calls are safe from
// several threads.
class ImageRegistrar {
 public:
  // region: where the MRI counts (> 0.5), on any voxels, e.g. the brain mask; nullptr: everywhere. Skull and scalp,
  // which ultrasound does not see, draw the pose away.
  // kInvalidArgument: an option out of range (named), an image without voxels, fewer than 2 along an axis or an
  // affine that cannot be inverted; kNotFinite: a voxel.
  static Result<ImageRegistrar> create(const VoxelImage& mri, const VoxelImage* region,
                                       const ImageRegistrationOptions& options = {});

  // kInvalidArgument: fewer than 500 samples; numbers of positions and intensities differ; all intensities (of the
  // samples, of the MRI where they are) alike; kNotFinite: names the sample. kEmptySet: too few samples inside the
  // MRI. kNotConverged: the best pose lies at the edge of the search.
  Result<ImageRegistration> align(const IntensitySamples& samples) const;

  const ImageRegistrationOptions& options() const { return options_; }

 private:
  ImageRegistrar() = default;
  ImageRegistrationOptions options_;
  std::vector<VoxelImage> levels_;
  std::optional<VoxelImage> region_;
};

}  // namespace brainshift::registration
