// SPDX-License-Identifier: Apache-2.0
#include "common/core/statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

namespace brainshift {

MeanStd mean_std(std::span<const double> values) {
  if (values.empty()) return {};
  const double n = static_cast<double>(values.size());
  double sum = 0.0;
  for (double v : values) sum += v;
  const double mean = sum / n;
  if (values.size() < 2) return {mean, 0.0};
  double squares = 0.0;
  for (double v : values) squares += (v - mean) * (v - mean);
  return {mean, std::sqrt(squares / (n - 1.0))};
}

MeanStd mean_std_of_norms(const Points& vectors) {
  const double n = static_cast<double>(vectors.cols());
  if (vectors.cols() == 0) return {};
  const auto norms = vectors.colwise().norm();  // an expression: nothing is stored
  const double mean = norms.sum() / n;
  if (vectors.cols() < 2) return {mean, 0.0};
  return {mean, std::sqrt((norms.array() - mean).square().sum() / (n - 1.0))};
}

double percentile(std::span<const double> values, double q) {
  assert(q >= 0.0 && q <= 100.0);
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double rank = q / 100.0 * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(std::floor(rank));
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double fraction = rank - std::floor(rank);
  return sorted[below] + fraction * (sorted[above] - sorted[below]);
}

}  // namespace brainshift
