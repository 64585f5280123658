// SPDX-License-Identifier: Apache-2.0
// Random numbers that depend on the seed alone. The standard specifies std::mt19937_64 bit for
// bit but not the distributions, so the conversions are written here.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // Uniform in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  // Standard normal (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  // Uniform on the unit sphere.
  Vec3 direction() {
    const double z = 2.0 * uniform() - 1.0;
    const double angle = 2.0 * std::numbers::pi * uniform();
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
  // 0-based index in [0, count).
  std::uint64_t index(std::uint64_t count) {
    return static_cast<std::uint64_t>(uniform() * static_cast<double>(count));
  }
  // `count` distinct indices in [0, total), in random order (Fisher-Yates). All of them if
  // count >= total.
  std::vector<int> choose(int count, int total) {
    std::vector<int> indices(static_cast<std::size_t>(total));
    std::iota(indices.begin(), indices.end(), 0);
    const int chosen = std::min(count, total);
    for (int i = 0; i < chosen; ++i) {
      const auto j = static_cast<std::size_t>(i) + index(static_cast<std::uint64_t>(total - i));
      std::swap(indices[static_cast<std::size_t>(i)], indices[j]);
    }
    indices.resize(static_cast<std::size_t>(chosen));
    return indices;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace brainshift
