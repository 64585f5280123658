// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/lesion_polar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace brainshift::ultrasound {
namespace {

constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();
constexpr double kImpossible = -1e30;

// Greatest step from ray to ray, in samples: the path may lean 60 degrees against the circle.
int greatest_step(const Eigen::MatrixXf& gain) {
  const double angle = 2.0 * std::numbers::pi / static_cast<double>(gain.rows());
  return std::max(
      1, static_cast<int>(std::ceil(1.7 * angle * static_cast<double>(gain.cols()) / 2.0)));
}

// The best path from ray `start` round to it again. With fixed >= 0 it begins and ends at that
// radius, else at any.
std::vector<int> best_path(const Eigen::MatrixXf& gain, const std::vector<RadiusRange>& range,
                           double stiffness, std::size_t start, int fixed) {
  const std::size_t rays = range.size();
  const auto radii = static_cast<std::size_t>(gain.cols());
  const int step = greatest_step(gain);
  std::vector<double> score(radii, kImpossible), next(radii);
  std::vector<std::vector<int>> from(rays + 1, std::vector<int>(radii, 0));
  for (int r = range[start].first; r <= range[start].last; ++r) {
    if (fixed < 0 || r == fixed) score[static_cast<std::size_t>(r)] = 0.0;
  }
  for (std::size_t k = 1; k <= rays; ++k) {
    const std::size_t ray = (start + k) % rays;
    std::fill(next.begin(), next.end(), kImpossible);
    for (int r = range[ray].first; r <= range[ray].last; ++r) {
      double best = kImpossible;
      int best_from = r;
      for (int p = std::max(0, r - step); p <= std::min(static_cast<int>(radii) - 1, r + step);
           ++p) {
        const double value = score[static_cast<std::size_t>(p)] - stiffness * std::abs(r - p);
        if (value > best) best = value, best_from = p;
      }
      next[static_cast<std::size_t>(r)] = best + gain(static_cast<Eigen::Index>(ray), r);
      from[k][static_cast<std::size_t>(r)] = best_from;
    }
    score.swap(next);
  }
  int at = fixed;
  if (fixed < 0)
    at = static_cast<int>(std::max_element(score.begin(), score.end()) - score.begin());
  std::vector<int> path(rays);
  for (std::size_t k = rays; k >= 1; --k) {
    path[(start + k) % rays] = at;
    at = from[k][static_cast<std::size_t>(at)];
  }
  return path;
}

}  // namespace

Eigen::MatrixXf smoothed_frame(const tracking::Recording& recording, int frame, double sd_px) {
  const int type = recording.pixel_type == tracking::PixelType::kUint8   ? CV_8U
                   : recording.pixel_type == tracking::PixelType::kInt16 ? CV_16S
                                                                         : CV_16U;
  const cv::Mat stored(recording.height, recording.width, type,
                       const_cast<char*>(recording.frame_bytes(frame).data()));
  cv::Mat image;
  stored.convertTo(image, CV_32F);
  if (sd_px > 0.0) cv::GaussianBlur(image, image, cv::Size(0, 0), sd_px);
  Eigen::MatrixXf values(recording.height, recording.width);
  for (int v = 0; v < image.rows; ++v) {
    values.row(v) = Eigen::Map<const Eigen::RowVectorXf>(image.ptr<float>(v), image.cols);
  }
  return values;
}

PolarImage polar_image(const Eigen::MatrixXf& image, const Eigen::Vector2d& centre_px, int rays,
                       int radii) {
  PolarImage polar(rays, radii);
  for (int j = 0; j < rays; ++j) {
    const double angle = 2.0 * std::numbers::pi * j / rays;
    for (int r = 0; r < radii; ++r) {
      const double u = centre_px.x() + r * std::cos(angle);
      const double v = centre_px.y() + r * std::sin(angle);
      const auto u0 = static_cast<Eigen::Index>(std::floor(u));
      const auto v0 = static_cast<Eigen::Index>(std::floor(v));
      if (u0 < 0 || v0 < 0 || u0 + 1 >= image.cols() || v0 + 1 >= image.rows()) {
        polar(j, r) = kMissing;
        continue;
      }
      const auto a = static_cast<float>(u - static_cast<double>(u0));
      const auto b = static_cast<float>(v - static_cast<double>(v0));
      polar(j, r) = (1 - b) * ((1 - a) * image(v0, u0) + a * image(v0, u0 + 1)) +
                    b * ((1 - a) * image(v0 + 1, u0) + a * image(v0 + 1, u0 + 1));
    }
  }
  return polar;
}

Eigen::MatrixXf edge_strength(const PolarImage& polar, int width) {
  Eigen::MatrixXf strength = Eigen::MatrixXf::Zero(polar.rows(), polar.cols());
  for (Eigen::Index r = 1; r + width < polar.cols(); ++r) {
    const Eigen::Index inside = std::min<Eigen::Index>(width, r);
    strength.col(r) = polar.middleCols(r - inside, inside).rowwise().mean() -
                      polar.middleCols(r + 1, width).rowwise().mean();
  }
  return strength.array().isNaN().select(0.0F, strength);
}

std::vector<int> best_closed_path(const Eigen::MatrixXf& gain,
                                  const std::vector<RadiusRange>& range, double stiffness) {
  // Half a turn away from where the open path began, its end effects are forgotten.
  const std::size_t opposite = range.size() / 2;
  const std::vector<int> open = best_path(gain, range, stiffness, 0, -1);
  return best_path(gain, range, stiffness, opposite, open[opposite]);
}

}  // namespace brainshift::ultrasound
