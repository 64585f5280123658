// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/interval_scores.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace brainshift::surgeries {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Probability that an isotropic Gaussian in three dimensions lies beyond r standard deviations.
double beyond(double r) {
  return std::erfc(r / std::numbers::sqrt2) +
         std::sqrt(2.0 / std::numbers::pi) * r * std::exp(-0.5 * r * r);
}

}  // namespace

double interval_score(double error, double sd) {
  const double half = kNormalQuantile95 * sd;
  return 2.0 * half + 20.0 * std::max(0.0, std::abs(error) - half);
}

double gaussian_crps(double error, double sd) {
  if (!(sd > 0.0)) return std::abs(error);
  const double z = std::abs(error) / sd;
  const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
  return sd * (z * std::erf(z / std::numbers::sqrt2) + 2.0 * density -
               1.0 / std::sqrt(std::numbers::pi));
}

double simultaneous_radius(long count) {
  double low = 0.0, high = 40.0;
  while (high - low > 1e-9) {
    const double middle = 0.5 * (low + high);
    (beyond(middle) > 0.1 / static_cast<double>(count) ? low : high) = middle;
  }
  return high;
}

RegionScore score_region(const Points& displacement, const Points& truth, const VecX& sd,
                         const std::vector<int>& nodes) {
  const bool has_sd = sd.size() == displacement.cols();
  RegionScore score;
  score.nodes = static_cast<int>(nodes.size());
  double squares = 0.0, variances = 0.0;
  for (const int node : nodes) {
    const Vec3 error = displacement.col(node) - truth.col(node);
    score.error_mm += error.norm();
    score.none_mm += truth.col(node).norm();
    squares += error.squaredNorm();
    if (!has_sd) continue;
    variances += sd[node] * sd[node];
    for (const double each : error) {
      score.coverage_90 += std::abs(each) <= kNormalQuantile95 * sd[node] ? 1.0 : 0.0;
      for (std::size_t i = 0; i < kIntervals.size(); ++i) {
        score.coverage[i] += std::abs(each) <= kIntervals[i].radius * sd[node] ? 1.0 : 0.0;
      }
      score.interval_mm += interval_score(each, sd[node]);
      score.crps_mm += gaussian_crps(each, sd[node]);
    }
  }
  const double count = nodes.empty() ? kUnknown : static_cast<double>(nodes.size());
  const double with_sd = has_sd ? count : kUnknown;
  score.error_mm /= count;
  score.none_mm /= count;
  score.rms_error_mm = std::sqrt(squares / (3.0 * count));
  score.rms_sd_mm = std::sqrt(variances / with_sd);
  score.coverage_90 /= 3.0 * with_sd;
  for (double& share : score.coverage) share /= 3.0 * with_sd;
  score.interval_mm /= 3.0 * with_sd;
  score.crps_mm /= 3.0 * with_sd;
  return score;
}

std::vector<int> nodes_near(const Points& mesh_nodes, const std::vector<int>& nodes,
                            const Points& places, double reach_mm) {
  std::vector<int> near;
  if (places.cols() == 0) return near;
  for (const int node : nodes) {
    const double squared =
        (places.colwise() - mesh_nodes.col(node)).colwise().squaredNorm().minCoeff();
    if (squared <= reach_mm * reach_mm) near.push_back(node);
  }
  return near;
}

}  // namespace brainshift::surgeries
