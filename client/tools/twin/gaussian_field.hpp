// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth random field without unit, as a place in the brain has it.
//
//   z(x): stationary Gaussian, mean 0, variance 1, covariance exp(-|x - y|^2 / 2 l^2)
// by random Fourier features (Rahimi & Recht 2007):
//   z(x) = sqrt(2 / M) sum_m cos(k_m . x + phi_m),   k_m ~ N(0, I / l^2), phi_m uniform, M = 200
#pragma once

#include <cstdint>

#include "common/core/types.hpp"

namespace brainshift::client {

class GaussianField {
 public:
  // length_mm: l, above 0. The same seed gives the same field.
  GaussianField(double length_mm, std::uint64_t seed);
  // x: mm.
  double at(const Vec3& x) const;

 private:
  Points waves_;
  VecX phases_;
};

// The standard normal's distribution function: turns z into a number uniform in (0, 1).
double normal_cdf(double z);

}  // namespace brainshift::client
