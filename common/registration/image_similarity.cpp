// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/image_similarity.hpp"

#include <algorithm>
#include <cmath>

namespace brainshift::registration {
namespace {

// Weights of the cubic B-spline at bins floor(m) - 1 .. floor(m) + 2, and their derivatives by m.
struct SplineWindow {
  int first = 0;
  Eigen::Vector4d weight, slope;
};

SplineWindow spline_window(double m) {
  const double floor = std::floor(m);
  const double t = m - floor, u = 1.0 - t;
  SplineWindow window;
  window.first = static_cast<int>(floor) - 1;
  window.weight << u * u * u / 6.0, 2.0 / 3.0 - t * t + 0.5 * t * t * t,
      2.0 / 3.0 - u * u + 0.5 * u * u * u, t * t * t / 6.0;
  window.slope << -0.5 * u * u, -2.0 * t + 1.5 * t * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t;
  return window;
}

double plogp(double p) { return p > 0.0 ? p * std::log(p) : 0.0; }

double entropy(const VecX& p) {
  double sum = 0.0;
  for (double value : p) sum -= plogp(value);
  return sum;
}

}  // namespace

double BinScale::position(double intensity) const {
  return 1.0 + (std::clamp(intensity, low, high) - low) * bins_per_unit();
}

BinScale quantile_scale(const VecX& values, double low_quantile, double high_quantile, int bins) {
  std::vector<double> sorted(values.begin(), values.end());
  const auto at = [&sorted](double quantile) {
    const auto rank =
        static_cast<std::ptrdiff_t>(quantile * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
    return sorted[static_cast<std::size_t>(rank)];
  };
  BinScale scale;
  scale.low = at(low_quantile);
  scale.high = at(high_quantile);
  scale.bins = bins;
  return scale;
}

JointHistogram::JointHistogram(int bins)
    : bins_(bins),
      p_(Eigen::MatrixXd::Zero(bins, bins)),
      slope_(Eigen::MatrixXd::Zero(bins, bins)) {}

void JointHistogram::clear() {
  p_.setZero();
  count_ = 0.0;
}

void JointHistogram::add(double s, double m) {
  const SplineWindow window = spline_window(m);
  const int column = static_cast<int>(s);
  const double t = s - column;
  p_.block<4, 1>(window.first, column) += (1.0 - t) * window.weight;
  p_.block<4, 1>(window.first, column + 1) += t * window.weight;
  count_ += 1.0;
}

// With F = (HA + HB) / HAB:  dF/dp(a,b) = (F (log p(a,b) + 1) - log pA(a) - log pB(b) - 2) / HAB.
// A term that is equal for all bins has no effect, since the sum of p does not change.
double JointHistogram::nmi() {
  slope_.setZero();
  if (count_ == 0.0) return 0.0;
  p_ /= count_;
  const VecX of_m = p_.rowwise().sum(), of_s = p_.colwise().sum();
  double joint = 0.0;
  for (double value : p_.reshaped()) joint -= plogp(value);
  if (!(joint > 0.0)) return 0.0;
  const double nmi = (entropy(of_m) + entropy(of_s)) / joint;
  for (int a = 0; a < bins_; ++a)
    for (int b = 0; b < bins_; ++b)
      if (p_(b, a) > 0.0)
        slope_(b, a) =
            (nmi * std::log(p_(b, a)) - std::log(of_s[a]) - std::log(of_m[b])) / (joint * count_);
  return nmi;
}

double JointHistogram::derivative(double s, double m) const {
  const SplineWindow window = spline_window(m);
  const int column = static_cast<int>(s);
  const double t = s - column;
  return (1.0 - t) * window.slope.dot(slope_.block<4, 1>(window.first, column)) +
         t * window.slope.dot(slope_.block<4, 1>(window.first, column + 1));
}

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
