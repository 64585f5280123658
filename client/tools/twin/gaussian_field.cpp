// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/gaussian_field.hpp"

#include <cmath>
#include <numbers>

#include "common/core/random.hpp"

namespace brainshift::client {
namespace {
constexpr int kFeatures = 200;
}

GaussianField::GaussianField(double length_mm, std::uint64_t seed)
    : waves_(3, kFeatures), phases_(kFeatures) {
  Random random(seed);
  for (int m = 0; m < kFeatures; ++m) {
    for (int axis = 0; axis < 3; ++axis) waves_(axis, m) = random.normal() / length_mm;
    phases_[m] = 2.0 * std::numbers::pi * random.uniform();
  }
}

double GaussianField::at(const Vec3& x) const {
  const VecX angles = waves_.transpose() * x + phases_;
  return std::sqrt(2.0 / kFeatures) * angles.array().cos().sum();
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace brainshift::client
