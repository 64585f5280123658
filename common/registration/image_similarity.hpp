// SPDX-License-Identifier: GPL-3.0-or-later
// How well samples placed by a rigid motion match an image: their normalised mutual information and its gradient.
//
//   m_i = M(T x_i), trilinear, over the samples with T x_i inside the image M;  NMI: joint_histogram.hpp
//   d NMI / d xi = sum_i (d NMI / d m_i) ((T x_i - c) x g_i, g_i),   g_i the gradient of M at T x_i
// for T replaced by rigid_increment(xi, c) T at xi = 0. Exact for the interpolated image while no sample enters or
// leaves it.
#pragma once

#include <optional>
#include "common/core/intensity_samples.hpp"
#include "common/core/mesh.hpp"
#include "common/registration/joint_histogram.hpp"
#include "common/registration/rigid_increment.hpp"

namespace brainshift::registration {

struct ImageValue {
  bool inside = false;
  double value = 0.0;
  Vec3 gradient = Vec3::Zero();  // per mm, RAS
};

// Trilinear interpolation with its gradient; inside: within the outermost voxel centres. Keeps a reference.
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
  Vec6 gradient = Vec6::Zero();  // by rotation vector (radians) and translation (mm)
  double overlap = 0.0;          // fraction of the samples inside the image
};

// Every stride-th sample of the set. Keeps references to image and samples. Not for two threads at once.
class ImageSimilarity {
 public:
  // region: where > 0.5 the image counts, on any voxels; nullptr: everywhere.
  ImageSimilarity(const VoxelImage& image, const VoxelImage* region, const BinScale& image_scale,
                  const IntensitySamples& samples, const BinScale& sample_scale, int stride);
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
