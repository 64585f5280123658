// SPDX-License-Identifier: GPL-3.0-or-later
// Random starts of a registration, and the errors at the tumour that it leaves.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/random.hpp"

namespace brainshift::sensing {

// Mean distance of the surface's vertices from where they belong.
double target_error_mm(const RigidTransform& T, const TriangleSurface& tumour);

// A motion with that target error: a turn about the tumour's centroid by up to 8 degrees (in
// proportion less below 5 mm) and a shift, both in random directions.
RigidTransform random_start(double error_mm, const TriangleSurface& tumour, Random& random);

struct Trial {
  double before_mm = 0.0;
  double after_mm = 0.0;  // as before where the registration was refused
  bool refused = false;
  double agreement = 0.0;
  double seconds = 0.0;
};

constexpr double kFound_mm = 1.0;  // paper 2.7: what re-registration left

struct TrialSummary {
  int count = 0;
  double found_percent = 0.0;  // error below kFound_mm
  double refused_percent = 0.0;
  double trusted_wrong_percent = 0.0;  // not refused, agreement at least one half, not found
  double trusted_percent = 0.0;
  double mean_before_mm = 0.0, mean_after_mm = 0.0, largest_after_mm = 0.0;  // of those not refused
  double mean_seconds = 0.0;
};
TrialSummary summarise(const std::vector<Trial>& trials);

// For one start: the correction found, to be applied after it, or a refusal.
struct Answer {
  bool refused = true;
  RigidTransform T_correction = RigidTransform::Identity();
  double agreement = 0.0;
};
using Method = std::function<Answer(const RigidTransform& T_start)>;

// Runs the method on `threads` threads; the starts depend on the seed alone.
std::vector<Trial> run_trials(const Method& method, double error_mm, int count, std::uint64_t seed,
                              const TriangleSurface& tumour, int threads);

}  // namespace brainshift::sensing
