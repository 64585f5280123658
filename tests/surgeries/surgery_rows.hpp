// SPDX-License-Identifier: GPL-3.0-or-later
// The table that `surgeries` writes: one row per update, all rows of a surgery at once.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/estimate.hpp"
#include "tests/surgeries/row_file.hpp"
#include "tests/surgeries/surgery_score.hpp"

namespace brainshift::surgeries {

// Which surgery a row belongs to.
struct SurgeryKey {
  std::string head;  // case_id of the case file
  int place = 0;     // from 1: tumour and opening
  std::uint64_t seed = 0;
  std::string scenario;
  RowFile::Key texts() const;  // of the columns kSurgeryKey
};
inline const std::vector<std::string> kSurgeryKey = {"head", "place", "seed", "scenario"};

// What an update used: "tumour", "tumour+cortex", "tumour+cortex+tracks".
std::string stage_name(int update);  // from 0

// Facts of a place and of the truth; the same for all updates of a surgery.
struct SurgeryFacts {
  SurgeryKey key;
  std::uint64_t patient_seed = 0;
  int nodes = 0, slaves = 0;
  double full_solve_ms = 0.0;  // t_solve, of this process
};

// One update. `scenario`: as it was played. `warm_cold_mm`: NaN where it was not measured.
Row row_of(const SurgeryFacts& facts, const client::Scenario& scenario,
           const io::SurgeryTruth& truth, int stage, const Update& update, const UpdateScore& score,
           double warm_cold_mm);
// An update that was refused: the columns of row_of, empty but for key, stage and reason.
Row refused_row(const SurgeryFacts& facts, int stage, const std::string& reason);

// The table of these rows (row_file.hpp), with kSurgeryKey.
Result<RowFile> open_surgeries(const std::filesystem::path& path, bool resume);

}  // namespace brainshift::surgeries
