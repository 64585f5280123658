// SPDX-License-Identifier: GPL-3.0-or-later
// All surgeries of one patient, estimated by every variant: the surgery is played once, then each
// variant's pipeline sees its observations. A row per update, those of `make evidence` with the
// variant beside the key.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "tests/ablations/ablation_truths.hpp"
#include "tests/ablations/parts.hpp"
#include "tests/surgeries/row_file.hpp"

namespace brainshift::ablations {

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
