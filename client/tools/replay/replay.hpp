// SPDX-License-Identifier: GPL-3.0-or-later
// Replay: plays a recorded surgery to a running daemon, once per boundary condition, and reports
// how well the estimates match the truth.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "client/tools/replay/play.hpp"
#include "client/tools/replay/run_report.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/session.hpp"

namespace brainshift::client {

struct ReplayOptions {
  std::filesystem::path surgery;
  std::string endpoint = "tcp://127.0.0.1:5555";
  std::filesystem::path report;  // report.json to write; replaced if it exists
  Speed speed = Speed::kMax;
  std::vector<Boundary> boundaries = {Boundary::kContact};
  Method method = Method::kCondensed;
  // Only observations of these sources are played; empty: all.
  std::vector<std::string> sources;
  // The journal of a session that was interrupted: what it holds is not played again, but for the
  // last observation of every source (ResumePoint in play.hpp). Empty: everything is played.
  std::filesystem::path resume;
  // Told in a sentence what is remarkable about the files, before the first run; may be empty.
  std::function<void(const std::string&)> on_note;
  // How often the recording is played; more than 1 at Speed::kMax only. Iterates are requested
  // only when it is 1: they would add to the latencies that repeating is there to measure.
  int repeat = 1;
  bool takeover = false;                          // ends another client's session
  std::optional<ClientKeys> keys = std::nullopt;  // for a daemon that asks for them
  // Written when not empty: one row per observation sent, see latency_csv(). With several
  // boundaries there is one file for each, with "-<boundary>" before the extension.
  std::filesystem::path latency_csv;
  // The longest silence before an observation counts as lost.
  std::chrono::milliseconds timeout{600000};
};

// Writes options.report. For each run with an estimate it writes
// `<stem>-<scenario>-<boundary>.vtu` beside it, with the point arrays displacement_estimated,
// where the update has them, sd_mm and known, and where truth is recorded, displacement_true (both
// mm, RAS, undeformed to deformed) and error_mm.
//
// Where no truth is recorded, a second session of method condensed leaves data out and predicts
// them (leave_one_out.hpp), unless the recording is repeated.
//
// The score is that of the last observation (of the last cycle) whose answer was usable
// (Update::usable), against the truth recorded with that observation. A run whose every field was
// unusable has no score and no field file. It is no failure of the replay: its report says so.
//
//   kNotFound, kUnreadable  the surgery file cannot be read
//   kEmptySet               nothing is left to play; the sentence names the sources there are
//   kInvalidArgument        the surgery is of another case or model than the daemon's, or `repeat`
//                           does not fit the options or the recording
//   kUnavailable            no daemon answers
//   kModelNotReady          the daemon has no model
//   kNotConverged           some run received no estimate at all; the report is written
//   kWriteFailed            a file cannot be written
// Otherwise an observation that fails is an entry of
// RunReport::failures, and the status is success.
// on_run: called with each run's report when that run has ended; may be empty.
Status replay(const ReplayOptions& options, const Progress& progress = {},
              const std::function<void(const RunReport&)>& on_run = {});

// Adds latencies, stage medians, verdicts and failures of a played session to `run`, and the status
// of its last update. The first update is the cold one (cold_ms). latency_ms is
// taken over the others, or over the cold one when there are no others.
void summarise(const PlayedSession& session, RunReport& run);

// One line for people: the run, how many updates of which quality, the flags, what was recovered.
std::string summary_line(const RunReport& run);

// A heading and one row per observation sent:
//   update,observation_sequence,latency_ms,register_ms,invert_ms,rebuild_ms,encode_ms,active,
//   contact_iterations,status
// `update` counts the rows from 1. Times are ms; active: slaves that
// carry a contact force. status is the estimate's. Without an estimate it
// is the error's code or "superseded", and the fields between are empty.
std::string latency_csv(const PlayedSession& session);

// The convergence history of the last update, with the cross-validation errors of the iterates
// that arrived. cross_of: error of a displacement field; nullopt without truth.
std::vector<TracePoint> trace_of(
    const PlayedSession& session,
    const std::function<std::optional<MeanStd>(const Points&)>& cross_of);

// RunUnit: t_solve, the unit of a run's times (contact::measure_full_solve_ms), measured by the
// program that plays the run, on the daemon's machine and after its last update. The model comes
// from the daemon, the material from the case file that the surgery names. Takes a factorisation
// and ten solves: three seconds and 0.4 GiB for 18 thousand nodes.
struct RunUnit {
  double factor_s = 0.0;
  double full_solve_ms = 0.0;
};

// kUnavailable where this process cannot measure it: the daemon is not reached over loopback or
// ipc, or has another BLAS kernel. The errors of io::read_case_config and
// contact::ForwardModel::build.
Result<RunUnit> measure_run_unit(const std::string& endpoint, const DaemonStatus& daemon,
                                 const BrainModel& model, const std::filesystem::path& case_file,
                                 Boundary boundary);

}  // namespace brainshift::client
