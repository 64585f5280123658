// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/image_similarity.hpp"

#include <cmath>

namespace brainshift::registration {

GradientInterpolator::GradientInterpolator(const VoxelImage& image)
    : image_(image), T_voxel_ras_(image.T_ras_voxel.inverse()) {}

ImageValue GradientInterpolator::operator()(const Vec3& x_ras) const {
  ImageValue result;
  const Vec3 x = T_voxel_ras_ * x_ras;
  int base[3];
  double t[3];
  for (int a = 0; a < 3; ++a) {
    // Written so that NaN is outside too.
    if (!(x[a] >= 0.0 && x[a] < image_.dims[static_cast<std::size_t>(a)] - 1)) return result;
    base[a] = static_cast<int>(x[a]);
    t[a] = x[a] - base[a];
  }
  // Interpolated along i at the four edges of the cell, then along j, then along k.
  double value[2][2], slope[2][2];
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j) {
      const double low = image_.at(base[0], base[1] + j, base[2] + k);
      const double high = image_.at(base[0] + 1, base[1] + j, base[2] + k);
      value[k][j] = low + t[0] * (high - low);
      slope[k][j] = high - low;
    }
  const auto mix = [](double low, double high, double at) { return low + at * (high - low); };
  const double near = mix(value[0][0], value[0][1], t[1]);
  const double far = mix(value[1][0], value[1][1], t[1]);
  const Vec3 by_voxel(
      mix(mix(slope[0][0], slope[0][1], t[1]), mix(slope[1][0], slope[1][1], t[1]), t[2]),
      mix(value[0][1] - value[0][0], value[1][1] - value[1][0], t[2]), far - near);
  result.inside = true;
  result.value = mix(near, far, t[2]);
  result.gradient = T_voxel_ras_.linear().transpose() * by_voxel;
  return result;
}

ImageSimilarity::ImageSimilarity(const VoxelImage& image, const VoxelImage* region,
                                 const BinScale& image_scale, const IntensitySamples& samples,
                                 const BinScale& sample_scale, int stride)
    : interpolator_(image),
      image_scale_(image_scale),
      sample_scale_(sample_scale),
      samples_(samples),
      stride_(stride),
      histogram_(image_scale.bins) {
  if (region) region_.emplace(*region);
  hits_.reserve(static_cast<std::size_t>(samples.positions.cols() / stride + 1));
}

Similarity ImageSimilarity::at(const RigidTransform& T_ras_samples, const Vec3& centre_ras) {
  histogram_.clear();
  hits_.clear();
  int asked = 0;
  const double per_unit = image_scale_.bins_per_unit();
  for (Eigen::Index i = 0; i < samples_.positions.cols(); i += stride_, ++asked) {
    const Vec3 x = T_ras_samples * samples_.positions.col(i);
    const ImageValue image = interpolator_(x);
    if (!image.inside || (region_ && !((*region_)(x).value > 0.5))) continue;
    const bool clipped = image.value < image_scale_.low || image.value > image_scale_.high;
    hits_.push_back({sample_scale_.position(samples_.intensities[i]),
                     image_scale_.position(image.value), x,
                     clipped ? Vec3(Vec3::Zero()) : Vec3(per_unit * image.gradient)});
    histogram_.add(hits_.back().s, hits_.back().m);
  }
  Similarity result;
  result.overlap = asked > 0 ? static_cast<double>(hits_.size()) / asked : 0.0;
  result.nmi = histogram_.nmi();
  for (const Hit& hit : hits_)
    result.gradient +=
        histogram_.derivative(hit.s, hit.m) * direction_gradient(hit.x, hit.gradient, centre_ras);
  return result;
}

}  // namespace brainshift::registration
