// SPDX-License-Identifier: GPL-3.0-or-later
// The truths of the ablations: those of `make evidence` (patients' own motions) and motions of
// `make surgeries` on the patients' heads, which need the families that the patients' do not.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "tests/ablations/parts.hpp"
#include "tests/evidence/patient_twin.hpp"
#include "tests/surgeries/row_file.hpp"

namespace brainshift::ablations {

// Consistency, each ingredient and all of them; then joint-tangential, joint-mixed,
// joint-distension, resection and retraction of the twin, "mannitol" (joint-sag in a brain or
// hemisphere that shrinks by kMinShrinkage to twice that) and "outliers" (joint-sag with gross
// errors in kOutliers of boundary points and landmarks). Another code's truth belongs to another
// mesh.
inline constexpr double kMinShrinkage = 0.02;
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

// All surgeries of one patient, estimated by every variant: the surgery is played once, then each
// variant's pipeline sees its observations. A row per update, those of `make evidence` with the
// variant beside the key.
struct AblationPlan {
  CaseConfig config;  // the patient's
  std::string head;
  int patient = 1;
  bool first = true;  // slow variants are played for the first patient alone
  double thousand_nodes = 6.0;
  std::vector<Part> parts;
  std::vector<AblationSurgery> surgeries;
};

// Called after each variant with how many surgeries it played and how long preparation and all of
// it took.
using Told = std::function<void(const std::string& variant, int surgeries, double prepared_s,
                                double seconds)>;

// Surgeries that `rows` has are skipped. A refused update is a row, not an error; so is a truth
// that does nothing on this patient. Errors: of meshing and preparing, of the twin, of scoring, of
// writing.
Status play_patient(const AblationPlan& plan, surgeries::RowFile& rows, const Told& told);

// The table of these rows, with the columns kAblationKey.
inline const std::vector<std::string> kAblationKey = {"head", "patient", "truth", "seed",
                                                      "variant"};
Result<surgeries::RowFile> open_ablations(const std::filesystem::path& path, bool resume);

// The row of `make evidence` with a column "variant" after the seed.
surgeries::Row with_variant(const surgeries::Row& row, const std::string& variant);

}  // namespace brainshift::ablations
