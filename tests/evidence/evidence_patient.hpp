// SPDX-License-Identifier: GPL-3.0-or-later
// All surgeries of one patient: for each truth and seed the twin, the daemon's pipeline under both
// boundary conditions over its observations, and a row per update. An estimate sees the
// observations alone.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "tests/evidence/evidence_rows.hpp"
#include "tests/evidence/patient_twin.hpp"

namespace brainshift::evidence {

struct PatientPlan {
  CaseConfig config;  // the patient's
  std::string head;
  int patient = 1;
  double thousand_nodes = 18.0;
  std::filesystem::path calculix;  // folder of another code's fields
  std::vector<TruthKind> truths;
  std::vector<std::uint64_t> seeds;
};

// Called after each surgery with its rows and how long it took.
using Told = std::function<void(const std::vector<surgeries::Row>&, double seconds)>;

// Surgeries that `rows` has are skipped. A refused update is a row, not an error; so is an
// ingredient that does nothing on this patient, and a head that CalculiX's fields are not of, with
// what says so as its reason. Errors: of meshing
// and preparing, of the twin, of scoring, of writing.
Status play_patient(const PatientPlan& plan, surgeries::RowFile& rows, const Told& told);

}  // namespace brainshift::evidence
