// SPDX-License-Identifier: GPL-3.0-or-later
// RunReport: what one run (scenario x method x boundary) of a replay showed; one object of
// report.json.
//
// The keys are those of visit() in run_report.cpp, most of them the names below. A value that does
// not apply (no truth recorded, no uncertainty computed, no update) is nullopt here and null in the
// file; a number that is not finite is null too. Readers ignore unknown keys, because newer writers
// may add some. Lengths are mm, times ms or s as the name says, angles degrees, shares percent.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::client {

struct MeshSize {
  int nodes = 0;
  int tets = 0;
  int slaves = 0;
};

// Over the final updates of a run but the first; over the first when it is the only one. Linear
// interpolation between order statistics.
struct LatencyPercentiles {
  double p50 = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

// mm; see score.hpp for the definition of each.
struct RunErrors {
  std::optional<MeanStd> initial;
  std::optional<MeanStd> sparse_initial;
  std::optional<MeanStd> sparse;
  std::optional<MeanStd> cross;
  std::optional<MeanStd> craniotomy_initial;
  std::optional<MeanStd> craniotomy;
  std::optional<MeanStd> craniotomy_displacement_initial;
  std::optional<MeanStd> craniotomy_displacement;
};

// Percentiles of |u_est - u_true| over all nodes, in percent of the largest |u_true|.
struct FieldError {
  double p50 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

// One iteration, as in the paper's Fig. 3. `cross` is null when that
// iterate did not arrive or no truth is recorded.
struct TracePoint {
  int iteration = 0;
  MeanStd sparse;
  std::optional<MeanStd> cross;
  int penetrating = 0;
  double max_penetration_mm = 0.0;
  double elapsed_ms = 0.0;
};

struct RunFailure {
  std::uint64_t observation_sequence = 0;
  std::string code;
  std::string message;
};

// Final updates by their verdict.
struct QualityCounts {
  int good = 0;
  int caution = 0;
  int unusable = 0;
  int not_judged = 0;
};

// Whether the fields of a run could be used (common/values/quality.hpp).
struct RunQuality {
  std::string worst;   // "unusable" if any update was, then "not_judged", "caution", "good"
  std::string last;    // of the last final update
  std::string reason;  // of the last final update
  QualityCounts counts;
  std::map<std::string, int> flags;          // name of each flag that was set -> number of updates
  std::vector<std::string> last_flags = {};  // of the last final update
};

// Strength of one part of the prior in the last usable update.
struct PartStrength {
  std::string part;
  double mean = 1.0;
  double absent = 0.0;  // probability
  bool at_bound = false;
};

// One set of strengths, and how probable the data of the last usable update make it.
struct WeightedStrengths {
  std::map<std::string, double> scales;  // by part
  double weight = 1.0;
};

// Mean motion of the tumour's nodes and its standard deviation (geometry::TumourMotion), mm.
struct TumourShift {
  double mean = 0.0;
  std::optional<double> sd;
};

// One observation of the recording and what became of it; of several cycles the last.
struct CoursePoint {
  double time_s = 0.0;  // since the first observation, when it was recorded
  std::string source;
  std::string quality;  // of its update; "failed", "superseded" without one
  std::string reason;   // why it is not good, or failed
  std::optional<double> tumour_mm, tumour_sd_mm;  // of a usable update
  std::optional<double> true_tumour_mm;           // where truth is recorded
  std::optional<double> misfit_mm;
  std::optional<double> latency_ms;
};

// What was left out and predicted from the rest, of one source (leave_one_out.hpp). Distances, mm.
struct LeftOutScore {
  std::string source;
  std::string kind;  // "landmarks", "tumour boundary", "cortical surface"
  int points = 0;
  int failed = 0;                     // points without a prediction: the rest gave no usable update
  MeanStd initial = {};               // from the undeformed brain
  std::optional<MeanStd> rigid = {};  // from a rigid fit to the rest; landmarks only
  MeanStd error = {};                 // from the prediction
  std::optional<double> coverage_90 = {};  // share inside the 90 % interval; landmarks only
};

struct RunReport {
  std::string case_id;
  std::string scenario;
  std::string method;
  std::string boundary;
  std::optional<std::uint64_t> seed;
  std::string model_id;
  std::string case_file;
  std::string surgery_file;
  std::string field_file;  // relative to the report; empty when no usable update came

  MeshSize mesh;
  std::optional<double> prepare_s;
  std::optional<double> factor_s;  // as full_solve_ms
  std::optional<std::uint64_t> model_bytes;
  std::optional<double> full_solve_ms;  // RunUnit; null where it cannot be measured

  int updates = 0;     // final updates received
  int superseded = 0;  // observations dropped by the daemon in favour of newer ones
  // Status, reason, contact, sources and everything scored are those of the last usable update.
  std::string status;
  std::string reason;
  std::optional<RunQuality> quality;             // null without updates
  std::optional<LatencyPercentiles> latency_ms;  // message sent -> final update received
  std::optional<double> cold_ms;                 // the first of them
  std::optional<double> first_iterate_ms;        // median; message sent -> first iterate received
  std::optional<StageTimings> stages_ms;         // medians over the final updates

  std::optional<TumourShift> tumour_shift_mm;
  std::vector<CoursePoint> course;
  std::vector<LeftOutScore> leave_one_out;  // of runs without a truth

  RunErrors error_mm;
  std::optional<double> recovery_pct;
  std::optional<double> craniotomy_recovery_pct;               // by closest-point distance
  std::optional<double> craniotomy_displacement_recovery_pct;  // by displacement, sliding included
  std::optional<FieldError> field_error_pct;
  std::optional<double> share_below_5_pct;
  std::optional<double> largest_true_displacement_mm;
  std::optional<double> coverage_90;
  std::optional<double> region_known;         // Estimate::region_known
  std::optional<double> ventricle_change_cc;  // Estimate::ventricle_change_mm3
  std::optional<ContactSummary> contact;
  std::optional<double> principal_direction_deg;
  std::optional<double> principal_direction_true_deg;

  std::map<std::string, double> truth_scalars;
  std::vector<Omission> left_out;
  std::vector<SourceSummary> sources;
  std::vector<PartStrength> prior_strengths;
  std::vector<WeightedStrengths> hypotheses;  // the most probable first
  std::vector<RunFailure> failures;
  std::optional<Error> lost;  // why the replay ended early; each failure says it in the file
  std::vector<TracePoint> trace;
};

// JSON text, an array with one object per run; two-space indentation.
std::string to_json(const std::vector<RunReport>& runs);

// kUnreadable: not JSON, not an array of objects, a required key (case, scenario, method,
// boundary) is missing, or a value has the wrong type. The sentence begins with `origin`, a file
// name, and names the key: "R.json: [0].error_mm.cross.mean ...".
Result<std::vector<RunReport>> from_json(const std::string& text, const std::string& origin);

// kWriteFailed; an existing file is replaced.
Status write_reports(const std::filesystem::path& path, const std::vector<RunReport>& runs);
// kNotFound, kUnreadable.
Result<std::vector<RunReport>> read_reports(const std::filesystem::path& path);

}  // namespace brainshift::client
