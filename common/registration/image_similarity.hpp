// SPDX-License-Identifier: GPL-3.0-or-later
// How well samples placed by a rigid motion match an image: their normalised mutual information
// and its gradient.
//
//   m_i = M(T x_i), trilinear, over the samples with T x_i inside the image M
//   NMI of the m_i and the samples' intensities: JointHistogram
//   d NMI / d xi = sum_i (d NMI / d m_i) ((T x_i - c) x g_i, g_i),   g_i the gradient of M at T
// x_i for T replaced by rigid_increment(xi, c) T at xi = 0. The gradient is exact for the
// interpolated image while no sample enters or leaves it.
#pragma once

#include <optional>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/registration/pose_information.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::registration {

// Joint distribution of two intensities and their normalised mutual information.
//
//   p(a, b) = 1/n sum_i L(a - s_i) B(b - m_i),   s_i, m_i: intensities of sample i in bins
//   NMI = (H(A) + H(B)) / H(A, B),               H = - sum p log p
// L: linear window (two bins). B: cubic B-spline (four bins), so that p and NMI have continuous
// derivatives in m_i.
// NMI is 1 for independent intensities and 2 where each determines the other. It does not depend
// on the units of either.
// Sources: Studholme, Hill & Hawkes, "An overlap invariant entropy measure of 3D medical image
// alignment", Pattern Recognition 32 (1999); B-spline window: Thevenaz & Unser, IEEE TIP 9 (2000).

// Linear map of an intensity range to bin positions. Values outside the range fall on its ends.
// One bin at the low end and two at the high end stay free for the windows' tails.
// Precondition: bins > 4 and high > low.
struct BinScale {
  double low = 0.0, high = 1.0;
  int bins = 32;

  double bins_per_unit() const { return (bins - 4) / (high - low); }
  // In [1, bins - 3].
  double position(double intensity) const;
};

// The range between two quantiles (0 to 1) of the values. Precondition: at least one value. When
// all values between the quantiles are equal, high == low.
BinScale quantile_scale(const VecX& values, double low_quantile, double high_quantile, int bins);

class JointHistogram {
 public:
  explicit JointHistogram(int bins);

  void clear();
  // s, m: bin positions in [1, bins - 3].
  void add(double s, double m);
  // NMI of what was added since clear(); 0 when the distribution is concentrated in one bin or
  // nothing was added. Call it once per clear(): it scales the counts.
  double nmi();
  // d NMI / d m of one of the samples that were added, per bin. Call it after nmi().
  double derivative(double s, double m) const;

 private:
  int bins_;
  double count_ = 0.0;
  Eigen::MatrixXd p_;      // rows: m; columns: s
  Eigen::MatrixXd slope_;  // d NMI / d p, up to a constant
};

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
