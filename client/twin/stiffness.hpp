// SPDX-License-Identifier: GPL-3.0-or-later
// A brain whose stiffness varies from place to place, which no estimate knows.
//
//   G(x) = G exp(s z(x)),   z: stationary Gaussian, variance 1, covariance exp(-|x - y|^2 / 2 l^2)
// z by random Fourier features (Rahimi & Recht 2007):
//   z(x) = sqrt(2 / M) sum_m cos(k_m . x + phi_m),   k_m ~ N(0, I / l^2), phi_m uniform
// z is rounded to kStiffnessClasses classes of equal width over +-2
// standard deviations: a label each.
#pragma once

#include <cstdint>

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"

namespace brainshift::client {

inline constexpr int kStiffnessClasses = 9;

struct VariedBrain {
  BrainModel model;   // labels of the mesh: classes of stiffness
  CaseConfig config;  // its regions: a material per class
};

// s = sd, l = length_mm. Replaces the labels and regions that the case had; node sets and surfaces
// stay. The same seed gives the same brain.
VariedBrain vary_stiffness(const BrainModel& model, const CaseConfig& config, double sd,
                           double length_mm, std::uint64_t seed);

}  // namespace brainshift::client
