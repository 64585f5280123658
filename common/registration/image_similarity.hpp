// SPDX-License-Identifier: GPL-3.0-or-later
// How well samples placed by a rigid motion match an image: their normalised mutual information
// and its gradient.
//
//   m_i = M(T x_i), trilinear, over the samples with T x_i inside the image M
//   NMI of the m_i and the samples' intensities: joint_histogram.hpp
//   d NMI / d xi = sum_i (d NMI / d m_i) ((T x_i - c) x g_i, g_i),   g_i the gradient of M at T
// x_i for T replaced by rigid_increment(xi, c) T at xi = 0. The gradient is exact for the
// interpolated image while no sample enters or leaves it.
#pragma once

#include <optional>
#include "common/core/mesh.hpp"
#include "common/registration/joint_histogram.hpp"
#include "common/registration/rigid_increment.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::registration {

struct ImageValue {
  bool inside = false;
  double value = 0.0;            // the image's unit
  Vec3 gradient = Vec3::Zero();  // per mm, RAS
};

// Trilinear interpolation with its gradient. Inside means within the outermost voxel centres.
// Keeps a reference to the image.
class GradientInterpolator {
 public:
  explicit GradientInterpolator(const VoxelImage& image);
  ImageValue operator()(const Vec3& x_ras) const;

 private:
  const VoxelImage& image_;
  AffineTransform T_voxel_ras_;
};

struct Similarity {
  double nmi = 0.0;
  Vec6 gradient = Vec6::Zero();  // by rotation vector (per radian) and translation (per mm)
  double overlap = 0.0;          // fraction of the samples inside the image
};

// Uses every stride-th sample. Keeps references to images and samples. at() changes the object, so
// each thread needs its own.
class ImageSimilarity {
 public:
  // region: the image counts where it is > 0.5, on any voxels; nullptr: everywhere.
  ImageSimilarity(const VoxelImage& image, const VoxelImage* region, const BinScale& image_scale,
                  const IntensitySamples& samples, const BinScale& sample_scale, int stride);
  // centre_ras: c of the gradient.
  Similarity at(const RigidTransform& T_ras_samples, const Vec3& centre_ras);

 private:
  struct Hit {
    double s, m;
    Vec3 x, gradient;  // gradient of m
  };
  GradientInterpolator interpolator_;
  std::optional<GradientInterpolator> region_;
  BinScale image_scale_, sample_scale_;
  const IntensitySamples& samples_;
  int stride_;
  JointHistogram histogram_;
  std::vector<Hit> hits_;
};

}  // namespace brainshift::registration
