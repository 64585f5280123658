// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "common/core/point_columns.hpp"

namespace brainshift::stereo {
namespace {

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointColumns>,
                                        PointColumns, 3, std::size_t>;

// The corner of a regular grid has 1.5 times the mean distance of its inside.
constexpr double kAlwaysInside = 2.0;

}  // namespace

std::vector<bool> distance_outliers(const Points& points, double sds, int neighbours) {
  const Eigen::Index n = points.cols();
  std::vector<bool> outlier(static_cast<std::size_t>(n), false);
  if (n <= neighbours) return outlier;
  const PointColumns cloud{points};
  KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  tree.buildIndex();
  // A point is its own nearest neighbour.
  const auto wanted = static_cast<std::size_t>(neighbours) + 1;
  std::vector<std::size_t> index(wanted);
  std::vector<double> squared(wanted);
  VecX mean_distance(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t found =
        tree.knnSearch(points.col(i).data(), wanted, index.data(), squared.data());
    double sum = 0.0;
    for (std::size_t k = 0; k < found; ++k) sum += std::sqrt(squared[k]);
    mean_distance[i] = sum / neighbours;
  }
  const double mean = mean_distance.mean();
  const double sd =
      std::sqrt((mean_distance.array() - mean).square().sum() / static_cast<double>(n - 1));
  const double most = std::max(mean + sds * sd, kAlwaysInside * mean);
  for (Eigen::Index i = 0; i < n; ++i)
    outlier[static_cast<std::size_t>(i)] = mean_distance[i] > most;
  return outlier;
}

}  // namespace brainshift::stereo
