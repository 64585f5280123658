// SPDX-License-Identifier: GPL-3.0-or-later
// One row of the study: an update of one simulated surgery, beside no correction, beside a rigid
// shift of the tumour and beside the best rigid motion.
#pragma once

#include <cstdint>
#include <string>

#include "common/io/recording/surgery_file.hpp"
#include "common/values/estimate.hpp"
#include "tests/surgeries/row_file.hpp"
#include "tests/surgeries/surgery_rows.hpp"

namespace brainshift::evidence {

struct EvidenceKey {
  std::string head;   // case_id of the head
  int patient = 1;    // of the paper
  std::string truth;  // TruthKind::name
  std::uint64_t seed = 0;
  surgeries::RowFile::Key texts() const;  // of the columns kEvidenceKey
};
inline const std::vector<std::string> kEvidenceKey = {"head", "patient", "truth", "seed"};

// What an update had: "tumour", "tumour+cortex", "tumour+cortex+tracks".
std::string data_name(int update);  // from 0

struct EvidenceFigures {
  EvidenceKey key;
  std::string boundary, data;
  int nodes = 0;
  // Mean error at the tumour of the translation that brings the measured boundary onto the tumour
  // best: what a rigid correction makes of the same data. NaN where there is none.
  double shift_tumour_mm = 0.0;
  double direction_deg = 0.0;       // estimate's principal direction to the case's gravity
  double true_direction_deg = 0.0;  // of the truth
};

surgeries::Row row_of(const EvidenceFigures& figures, const io::SurgeryTruth& truth,
                      const Update& update, const surgeries::UpdateScore& score);
// The same columns, empty but for key, boundary, data and reason.
surgeries::Row refused_row(const EvidenceFigures& figures, const std::string& reason);

Result<surgeries::RowFile> open_evidence(const std::filesystem::path& path, bool resume);

}  // namespace brainshift::evidence
