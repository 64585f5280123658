// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid registration of an image given as samples, e.g. tracked ultrasound before the dura is
// opened, to the patient's MRI by normalised mutual information (paper 2.7). It removes the error
// that a registration by fiducials leaves.
//
//   T_ras_ras = argmax over T  NMI(M(T x_i), I_i)                       (image_similarity.hpp)
//
// The search (ascend) goes from coarse to fine. On each level M is smoothed by a Gaussian and every
// k-th sample is used. On the coarsest level the search begins at the given pose and at
// six others, `start_offset_mm` from it along each axis. They are followed to the second finest
// level, and the best goes on to the finest.
// Mutual information asks only that intensities go together, not how: sulci may be dark in one
// image and bright in the other. Bins are of equal width, so intensities should not crowd at one
// end. Pass ultrasound log-compressed, as displayed.
//
// Assumption: the tissue moved as a rigid body between the images, as it nearly does while the
// dura is closed.
// The optimum does not tell whether the images show the same thing; `agreement` and the errors do.
// Sources: Ji, Wu, Hartov, Roberts & Paulsen, Med. Phys. 35 (2008), re-registration before the
// dura is opened; Studholme et al. 1999.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/registration/pose_information.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::registration {

// The rigid motion near a first one at which a smooth function is greatest, by the quasi-Newton
// method BFGS.
//
//   z = (radius w, t), xi = (w, t): all six in mm;  T <- rigid_increment(xi, c) T,  c = T centre
//   step p = H g, H the inverse-Hessian estimate (BFGS, H = scaled identity at first), halved
//   until f(T(p)) >= f(T) + 1e-4 g . p                                                 (Armijo)
// Gradients of successive poses are compared as if their tangent spaces were the same. They differ
// by half a step's angle.
// Source: Nocedal & Wright, Numerical Optimization (2006), algorithm 6.1.
struct PoseValue {
  // False outside of the function's domain. Such a pose is never taken.
  bool valid = false;
  double value = 0.0;
  Vec6 gradient = Vec6::Zero();  // by xi about the given centre, per radian and per mm
};
using PoseFunction = std::function<PoseValue(const RigidTransform& T, const Vec3& centre)>;

struct PoseAscentOptions {
  int max_iterations = 60;
  double first_step_mm = 1.0;
  // About the size of what the function resolves, so that no step jumps over a hill.
  double largest_step_mm = 3.0;
  double tolerance_mm = 0.01;  // converged when a step is shorter
};

struct PoseAscent {
  RigidTransform T = RigidTransform::Identity();
  double value = 0.0;
  int iterations = 0, evaluations = 0;
  bool valid = false;      // the function is defined at the first pose
  bool converged = false;  // a step was below the tolerance, or no step went up
};

// centre: of the moved points, in their own frame, mm. radius_mm > 0: their rms distance from it.
PoseAscent ascend(const PoseFunction& function, const RigidTransform& T_initial, const Vec3& centre,
                  double radius_mm, const PoseAscentOptions& options = {});

// The options of ImageRegistrar. Every error about them or the images names the value.
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
  // Fraction of the starts that came to the pose taken. A low value says that the images match in
  // several ways. In the study (tests/sensing/reregistration_study.cpp) no pose that half of the
  // starts came to was wrong; with less, a person should check it.
  double agreement = 0.0;
};

// The MRI, smoothed for each level. It is set up once and used for any number of registrations.
// const calls are safe from several threads.
class ImageRegistrar {
 public:
  // region: where the MRI counts (> 0.5), on any voxels, e.g. the brain mask; nullptr: everywhere.
  // Skull and scalp, which ultrasound does not see, draw the pose away.
  // kInvalidArgument: an option out of range (named), an image without voxels or with fewer than 2
  // along an axis, an affine that cannot be inverted. kNotFinite: a voxel.
  static Result<ImageRegistrar> create(const VoxelImage& mri, const VoxelImage* region,
                                       const ImageRegistrationOptions& options = {});

  // samples: places in mm RAS as the fiducials register them, intensities of any unit.
  // kInvalidArgument: fewer than 500 samples; numbers of positions and intensities that differ;
  // all samples at one place; equal intensities (of all samples, or of the MRI at all of them).
  // kNotFinite: names the sample. kEmptySet: too few samples inside the MRI, or inside the region,
  // which the sentence calls the brain. kNotConverged: the best pose lies at the edge of the
  // search.
  Result<ImageRegistration> align(const IntensitySamples& samples) const;
  // From the given pose alone, on the finest level: where a pose is nearly known. Errors as above.
  Result<ImageRegistration> refine(const IntensitySamples& samples) const;

  // The samples' centroid, and what their NMI on the finest level tells about a motion from where
  // they are placed now: hessian = - d^2 NMI / dz^2 and gradient = - d NMI / dz,
  // z = (radius w, t), by central differences of the exact gradient, kCurvatureStep_mm to either
  // side. Their unit is that of NMI per mm^2 and per mm, so that only ratios say something. Errors
  // as above.
  Result<PoseInformation> information(const IntensitySamples& samples) const;
  static constexpr double kCurvatureStep_mm = 0.5;

  // The poses, as align gives them, of the samples without one part each: part p of n holds the
  // samples [p m / n, (p + 1) m / n) of m. The samples are placed at the pose of all. Errors as
  // above; the sentence names the part. Precondition: parts >= 2.
  Result<std::vector<RigidTransform>> poses_without_parts(const IntensitySamples& samples,
                                                          int parts) const;

 private:
  Result<ImageRegistration> follow(const IntensitySamples& samples,
                                   const std::vector<RigidTransform>& starts,
                                   std::size_t first_level) const;
  ImageRegistrar() = default;
  ImageRegistrationOptions options_;
  std::vector<VoxelImage> levels_;
  std::optional<VoxelImage> region_;
};

// How far the pose of all samples puts a point wrong, mm, rms, from the poses without one of n
// parts each (delete-a-group jackknife):
//
//   e(x)^2 = (n - 1) / n  sum_p |T_p x - mean_q T_q x|^2
//
// Assumption: the parts err independently. What they share (calibration, speed of sound, tissue
// that moved) is not in it. Precondition: at least two poses.
// Source: Efron & Tibshirani, An Introduction to the Bootstrap (1993), ch. 11.
double jackknife_error_mm(const std::vector<RigidTransform>& poses, const Vec3& x);

}  // namespace brainshift::registration
