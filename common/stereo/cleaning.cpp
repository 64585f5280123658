// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/cleaning.hpp"

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/point_columns.hpp"

namespace brainshift::stereo {
namespace {

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointColumns>,
                                        PointColumns, 3, std::size_t>;

// The corner of a regular grid has 1.5 times the mean distance of its inside.
constexpr double kAlwaysInside = 2.0;

// Labels of parts that hang together, -1 where the map is not valid; and the size of each.
struct Parts {
  PixelMap<int> label;
  std::vector<int> sizes;
};

Parts parts_of(const PixelMap<float>& disparity, double max_step_px) {
  Parts parts{{disparity.width, disparity.height, -1}, {}};
  std::vector<std::pair<int, int>> open;
  for (int y0 = 0; y0 < disparity.height; ++y0) {
    for (int x0 = 0; x0 < disparity.width; ++x0) {
      if (std::isnan(disparity.at(x0, y0)) || parts.label.at(x0, y0) >= 0) continue;
      const int label = static_cast<int>(parts.sizes.size());
      parts.sizes.push_back(0);
      parts.label.at(x0, y0) = label;
      open.emplace_back(x0, y0);
      while (!open.empty()) {
        const auto [x, y] = open.back();
        open.pop_back();
        ++parts.sizes.back();
        for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
          const int u = x + dx, v = y + dy;
          if (u < 0 || v < 0 || u >= disparity.width || v >= disparity.height) continue;
          // A comparison with NaN is false.
          if (parts.label.at(u, v) >= 0 ||
              !(std::abs(disparity.at(u, v) - disparity.at(x, y)) <= max_step_px))
            continue;
          parts.label.at(u, v) = label;
          open.emplace_back(u, v);
        }
      }
    }
  }
  return parts;
}

PartSizes drop(PixelMap<float>& disparity, const Parts& parts, double least) {
  PartSizes sizes;
  for (std::size_t i = 0; i < disparity.pixels.size(); ++i) {
    const int label = parts.label.pixels[i];
    if (label < 0) continue;
    const int size = parts.sizes[static_cast<std::size_t>(label)];
    sizes.largest = std::max(sizes.largest, size);
    if (size >= least) {
      ++sizes.left;
    } else {
      ++sizes.dropped;
      disparity.pixels[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return sizes;
}

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

PartSizes drop_small_parts(PixelMap<float>& disparity, double max_step_px, int least) {
  return drop(disparity, parts_of(disparity, max_step_px), least);
}

PartSizes drop_minor_parts(PixelMap<float>& disparity, double max_step_px, double fraction) {
  const Parts parts = parts_of(disparity, max_step_px);
  const auto largest = std::max_element(parts.sizes.begin(), parts.sizes.end());
  return drop(disparity, parts, largest == parts.sizes.end() ? 0.0 : fraction * *largest);
}

}  // namespace brainshift::stereo
