// SPDX-License-Identifier: GPL-3.0-or-later
// What one update of a simulated surgery is worth: its errors beside those of no correction and of
// the best rigid motion, and what its error bars are worth. The truth is read here only.
//
// All lengths are mm. Nodes inside a cavity (truth point kind `removed`) are no tissue and are left
// out of everything that is said of nodes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "tests/surgeries/interval_scores.hpp"
#include "tests/surgeries/row_file.hpp"

namespace brainshift::surgeries {

struct FieldErrors {
  double tumour_mm = 0.0;              // mean over cross-validation points
  double craniotomy_mm = 0.0;          // mean over its nodes, by displacement
  double craniotomy_closest_mm = 0.0;  // mean, by closest point of the true surface (CPPD)
  double mean_mm = 0.0, p50_mm = 0.0, max_mm = 0.0;  // over all nodes
};

struct UpdateScore {
  FieldErrors estimate;
  FieldErrors none;  // of no correction
  // Of the rigid motion that fits the true motion of the tumour's surface best, carried to the
  // whole brain: no rigid registration to the tumour can do better there.
  FieldErrors rigid;
  double recovered_pct = 0.0;  // 100 (1 - estimate / none) at the tumour
  // Nodes whose error exceeds that of no correction by more than their own 90 % interval, and the
  // largest excess: |u - t| - |t| - kRadius90 sd. Without sd the interval is 0.
  int worse_nodes = 0;
  double worst_excess_mm = 0.0;
  double coverage_90 = 0.0;  // of nodal components within 1.6449 sd; NaN without sd
  std::array<double, kIntervals.size()> coverage = {};  // the same for each of kIntervals
  double mean_sd_mm = 0.0;                              // NaN without sd
  // All nodes; within kNear_mm of what was measured; the rest; those of the opening.
  RegionScore all, near, far, cortex;
  // Means of Estimate::known; and over the far nodes that the update does not mark as unseen (known
  // is kLeastKnown or more) the root mean square of the error's length: 0 where it marks them all.
  // NaN without `known`.
  double near_known = 0.0, far_known = 0.0, far_unmarked_mm = 0.0;
  // Like worse_nodes, but by more than a band that holds all nodes at once with 90 %
  // (simultaneous_radius).
  int beyond_band = 0;
};
inline constexpr double kNear_mm = 30.0;

// Radius of the ball that holds 90 % of an isotropic Gaussian in three dimensions, in standard
// deviations of a component: the square root of the 0.9 quantile of chi-square with 3 degrees of
// freedom, 6.2514.
inline constexpr double kRadius90 = 2.5003;

// stage: says what was measured, as below: the tumour's outline as far as it is seen, from stage 1
// on the opening too. Errors of client::score and registration::register_fiducials.
Result<UpdateScore> score_update(const BrainModel& model, const io::SurgeryTruth& truth,
                                 const Estimate& estimate, int stage = 0);

// The table that `surgeries` writes: one row per update, all rows of a surgery at once.
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
