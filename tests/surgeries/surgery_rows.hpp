// SPDX-License-Identifier: GPL-3.0-or-later
// The table that `surgeries` writes: one row per update, all rows of a surgery at once, so that an
// interrupted run keeps whole surgeries.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/twin/scenario.hpp"
#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/estimate.hpp"
#include "tests/surgeries/surgery_score.hpp"

namespace brainshift::surgeries {

// Heading and cell, in the order of the columns.
using Row = std::vector<std::pair<std::string, std::string>>;

// Which surgery a row belongs to.
struct SurgeryKey {
  std::string head;  // case_id of the case file
  int place = 0;     // from 1: tumour and opening
  std::uint64_t seed = 0;
  std::string scenario;
  bool operator<(const SurgeryKey& other) const;
};

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

class RowFile {
 public:
  // Starts an empty table, or with `resume` goes on with one that is there. kUnreadable when that
  // one has other columns or ends within a row.
  static Result<RowFile> open(const std::filesystem::path& path, bool resume);
  bool has(const SurgeryKey& key) const { return done_.count(key) > 0; }
  // All rows of one surgery, by one write.
  Status append(const SurgeryKey& key, const std::vector<Row>& rows);

 private:
  std::filesystem::path path_;
  std::set<SurgeryKey> done_;
};

}  // namespace brainshift::surgeries
