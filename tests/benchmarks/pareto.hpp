// SPDX-License-Identifier: GPL-3.0-or-later
// The Pareto front of a set of (cost, error) pairs: those that no other one beats in both.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace brainshift::bench {

// Indices into `points`, by ascending first value. The front holds the points that no other
// dominates: none has both values at most as large and one smaller. Of equal points the front
// holds the first; points that are not finite are left out.
inline std::vector<std::size_t> pareto_front(const std::vector<std::pair<double, double>>& points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order, [&](std::size_t i) {
    return !std::isfinite(points[i].first) || !std::isfinite(points[i].second);
  });
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return points[a] < points[b]; });
  std::vector<std::size_t> front;
  for (const std::size_t i : order) {
    if (front.empty() || points[i].second < points[front.back()].second) front.push_back(i);
  }
  return front;
}

}  // namespace brainshift::bench
