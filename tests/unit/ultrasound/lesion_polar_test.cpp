// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/lesion_polar.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/random.hpp"

namespace brainshift::ultrasound {
namespace {

tracking::Recording one_frame(int width, int height) {
  tracking::Recording recording;
  recording.width = width, recording.height = height;
  recording.time_s = {0.0};
  recording.image_ok = {1};
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) recording.pixels += static_cast<char>(10 + 2 * u + 3 * v);
  return recording;
}

TEST(SmoothedFrame, IsTheFrameWithoutSmoothing) {
  const tracking::Recording recording = one_frame(12, 9);
  EXPECT_EQ(smoothed_frame(recording, 0, 0.0), recording.frame_values(0));
}

TEST(SmoothedFrame, KeepsALinearImageInTheMiddle) {
  const tracking::Recording recording = one_frame(31, 25);
  const Eigen::MatrixXf smoothed = smoothed_frame(recording, 0, 2.0);
  // A symmetric window whose half-width, 4 sd, stays inside the image.
  EXPECT_NEAR(smoothed(12, 15), recording.frame_values(0)(12, 15), 1e-3);
}

TEST(PolarImage, IsExactForALinearImageAndMissingOutside) {
  Eigen::MatrixXf image(40, 60);
  for (int v = 0; v < 40; ++v)
    for (int u = 0; u < 60; ++u) image(v, u) = static_cast<float>(5 + 0.5 * u - 0.25 * v);
  const Eigen::Vector2d centre(30.2, 20.6);
  const PolarImage polar = polar_image(image, centre, 8, 40);
  ASSERT_EQ(polar.rows(), 8);
  ASSERT_EQ(polar.cols(), 40);
  for (int j = 0; j < 8; ++j) {
    const double angle = 2.0 * std::numbers::pi * j / 8;
    for (int r = 0; r < 15; ++r) {
      const double u = centre.x() + r * std::cos(angle), v = centre.y() + r * std::sin(angle);
      EXPECT_NEAR(polar(j, r), 5 + 0.5 * u - 0.25 * v, 1e-4) << "ray " << j << " radius " << r;
    }
    EXPECT_TRUE(std::isnan(polar(j, 39))) << "every ray leaves the image before 39 px";
  }
}

TEST(EdgeStrength, IsInsideMinusOutsideAndGreatestAtTheEdge) {
  PolarImage polar = PolarImage::Constant(3, 30, 20.0F);
  polar.leftCols(12).setConstant(70.0F);
  polar(2, 14) = std::nanf("");
  const Eigen::MatrixXf strength = edge_strength(polar, 4);
  // At radius 12 the four samples inside are 70, the four outside 20.
  EXPECT_FLOAT_EQ(strength(0, 12), 50.0F);
  EXPECT_LE(strength.maxCoeff(), 50.0F);
  EXPECT_FLOAT_EQ(strength(0, 5), 0.0F);
  EXPECT_FLOAT_EQ(strength(2, 12), 0.0F) << "a sample is missing";
}

double score(const Eigen::MatrixXf& gain, const std::vector<int>& path, double stiffness) {
  double sum = 0.0;
  for (std::size_t j = 0; j < path.size(); ++j)
    sum += gain(static_cast<Eigen::Index>(j), path[j]) -
           stiffness * std::abs(path[j] - path[(j + 1) % path.size()]);
  return sum;
}

// Every closed path with radius steps of at most `step`, tried one by one.
double best_score(const Eigen::MatrixXf& gain, double stiffness, int step) {
  const auto rays = static_cast<std::size_t>(gain.rows());
  std::vector<int> path(rays, 0);
  double best = -1e30;
  for (;;) {
    bool allowed = true;
    for (std::size_t j = 0; j < rays; ++j)
      allowed = allowed && std::abs(path[j] - path[(j + 1) % rays]) <= step;
    if (allowed) best = std::max(best, score(gain, path, stiffness));
    std::size_t j = 0;
    while (j < rays && ++path[j] == gain.cols()) path[j++] = 0;
    if (j == rays) return best;
  }
}

TEST(BestClosedPath, IsThatOfATrialOfAllPaths) {
  constexpr int kRays = 7, kRadii = 5;
  // The path may lean 60 degrees: 1.7 * 2 pi / 7 * 5 / 2 = 3.8 samples a ray.
  constexpr int kStep = 4;
  const std::vector<RadiusRange> all(kRays, {0, kRadii - 1});
  int best = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Eigen::MatrixXf gain(kRays, kRadii);
    for (float& value : gain.reshaped()) value = static_cast<float>(random.normal());
    for (int j = 0; j < kRays; ++j) gain(j, 2) += 1.0F;  // an edge at radius 2
    const std::vector<int> path = best_closed_path(gain, all, 0.3);
    ASSERT_EQ(path.size(), static_cast<std::size_t>(kRays));
    const double reached = score(gain, path, 0.3), greatest = best_score(gain, 0.3, kStep);
    EXPECT_LE(reached, greatest + 1e-5);
    best += reached > greatest - 1e-5;
  }
  // Two passes may miss the best path where the first one passes the opposite ray elsewhere.
  EXPECT_GE(best, 16) << "of 20";
}

TEST(BestClosedPath, StaysInItsRange) {
  Eigen::MatrixXf gain = Eigen::MatrixXf::Zero(8, 10);
  gain.col(9).setConstant(5.0F);
  std::vector<RadiusRange> range(8, {2, 6});
  range[3] = {4, 4};
  const std::vector<int> path = best_closed_path(gain, range, 0.1);
  for (std::size_t j = 0; j < path.size(); ++j) {
    EXPECT_GE(path[j], range[j].first);
    EXPECT_LE(path[j], range[j].last);
  }
  EXPECT_EQ(path[3], 4);
}

}  // namespace
}  // namespace brainshift::ultrasound
