// SPDX-License-Identifier: GPL-3.0-or-later
// Brains whose stiffness varies from place to place, which no estimate knows.
#pragma once

#include <array>
#include <cstdint>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

// A smooth random field without unit, as a place in the brain has it.
//
//   z(x): stationary Gaussian, mean 0, variance 1, covariance exp(-|x - y|^2 / 2 l^2)
// by random Fourier features (Rahimi & Recht 2007):
//   z(x) = sqrt(2 / M) sum_m cos(k_m . x + phi_m),   k_m ~ N(0, I / l^2), phi_m uniform, M = 200
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

// A brain whose stiffness varies from place to place, which no estimate knows.
//
//   G(x) = G exp(s z(x)),   z: a GaussianField
// z is rounded to kStiffnessClasses classes of equal width over +-2 standard deviations, a label
// each.
inline constexpr int kStiffnessClasses = 9;

struct VariedBrain {
  BrainModel model;   // labels of the mesh: classes of stiffness
  CaseConfig config;  // its regions: a material per class
};

// s = sd, l = length_mm. Replaces the labels and regions that the case had; node sets and surfaces
// stay. The same seed gives the same brain.
VariedBrain vary_stiffness(const BrainModel& model, const CaseConfig& config, double sd,
                           double length_mm, std::uint64_t seed);

// Tissues that no case tells apart, each stiffer or softer than the case says, and beside that the
// field above at several lengths at once:
//   G(x) = G f exp(s z(x)),   f = 1 +- s for each tissue,   z = sum over L lengths of z_l / sqrt(L)
// No segmentation comes with a head, so the tissues are told apart by place:
//   tumour      inside its surface
//   grey        within kCortex_mm of the brain's surface: about the thickness of the cortex
//   ventricles  two ellipsoids beside the middle of the brain, of about the size and place that the
//               bodies of the lateral ventricles have
//   white       the rest
enum class Tissue { kTumour, kGrey, kWhite, kVentricle };
inline constexpr int kTissues = 4;
inline constexpr double kTissueSd = 0.3;  // s: grey and white matter differ by some 30 %
inline constexpr std::array kTissueLengths_mm = {10.0, 20.0, 40.0};
inline constexpr double kCortex_mm = 4.0;

// Replaces the labels, the regions and the tumour's material that the case had. The same seed gives
// the same brain. Errors of geometry::ClosestPointIndex.
Result<VariedBrain> vary_tissues(const BrainModel& model, const CaseConfig& config,
                                 std::uint64_t seed);

}  // namespace brainshift::client
