// SPDX-License-Identifier: GPL-3.0-or-later
// A brain whose stiffness varies in ways that no estimate knows.
//
//   G(x) = G exp(s z(x)),   z: stationary Gaussian, unit variance, covariance exp(-|x - y|^2 / 2 l^2), by random Fourier
//   features: z(x) = sqrt(2 / M) sum_m cos(k_m . x + phi_m), k_m ~ N(0, I / l^2), phi_m uniform (Rahimi & Recht 2007)
// in kStiffnessClasses classes of equal width over +-2 standard deviations, so that it fits the labels of a mesh.
#pragma once

#include <cstdint>

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"

namespace brainshift::client {

inline constexpr int kStiffnessClasses = 9;

struct VariedBrain {
  BrainModel model;  // the mesh has a label per class
  CaseConfig config;
};

// Labels and regions that the case had are replaced; node sets and surfaces stay. The same seed gives the same brain.
VariedBrain vary_stiffness(const BrainModel& model, const CaseConfig& config, double sd,
                           double length_mm, std::uint64_t seed);

}  // namespace brainshift::client
