// SPDX-License-Identifier: GPL-3.0-or-later
// The truths of the ablations: those of `make evidence` (patients' own motions) and motions of
// `make surgeries` on the patients' heads, which need the families that the patients' do not.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/evidence/patient_twin.hpp"

namespace brainshift::ablations {

// Consistency, each ingredient and all of them; then joint-tangential, joint-mixed,
// joint-distension, resection and retraction of the twin, "mannitol" (joint-sag in a brain or
// hemisphere that shrinks by kLeastShrinkage to twice that) and "outliers" (joint-sag with gross
// errors in kOutliers of boundary points and landmarks). Another code's truth belongs to another
// mesh.
inline constexpr double kLeastShrinkage = 0.02;
inline constexpr double kOutliers = 0.2;
const std::vector<std::string>& truth_names();

struct AblationSurgery {
  std::string truth;
  std::uint64_t seed = 0;
};
// Of one patient: a seed for each truth, and kSeedsPerMotion for each motion, because a motion is
// varied by its seed and has no group to join (tests/studies/ablations.py). Seeds are
// first_seed + patient - 1, and evidence::kPatients more each time.
inline constexpr int kSeedsPerMotion = 4;
std::vector<AblationSurgery> surgeries_of(int patient, std::uint64_t first_seed,
                                          const std::vector<std::string>& truths);

// Errors of PatientTwin::play. Precondition: the truth is one of truth_names().
Result<evidence::PlayedSurgery> play(evidence::PatientTwin& twin, const AblationSurgery& surgery);

}  // namespace brainshift::ablations
