// SPDX-License-Identifier: GPL-3.0-or-later
// Replay: a recorded surgery, played to a running daemon once per boundary condition, scored and reported.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "client/replay/play.hpp"
#include "client/replay/run_report.hpp"
#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct ReplayOptions {
  std::filesystem::path surgery;
  std::string endpoint = "tcp://127.0.0.1:5555";
  std::filesystem::path report;  // report.json to write; replaced if it exists
  Speed speed = Speed::kMax;
  std::vector<Boundary> boundaries = {Boundary::kContact, Boundary::kFixed};
  Method method = Method::kCondensed;
  // Only observations of these sources are played; empty: all.
  std::vector<std::string> sources;
  // Each observation is played so many times, in a cycle; above 1 only at Speed::kMax. Iterates are asked for
  // only when it is 1: they would weigh on the latencies that repeating is there to measure.
  int repeat = 1;
  // Written when not empty: one row per observation sent, see latency_csv(). With several boundaries one file
  // each, "-<boundary>" before the extension.
  std::filesystem::path latency_csv;
  std::chrono::milliseconds timeout{
      600000};  // longest silence before an observation counts as lost
};

// Writes options.report and, beside it, per run with an estimate `<stem>-<scenario>-<boundary>.vtu` with the
// point arrays displacement_estimated and, where truth is recorded, displacement_true (mm, RAS, moves an
// undeformed point to its deformed place) and error_mm.
//
// Scored is the last answered observation, in the last cycle when repeated, against the truth of the recorded
// observation that was sent.
//
// kEmptySet when no observation is left, naming the sources that the surgery has;
// kNotFound / kUnreadable name the surgery file; kInvalidArgument: the daemon holds another case or model
// than the surgery was recorded for, or `repeat` does not fit; kUnavailable: no daemon; kModelNotReady: no model loaded there. The
// report is still written when observations fail; the status is then kNotConverged if some run received no
// successful update at all.
Status replay(const ReplayOptions& options, const Progress& progress = {});

// `run` completed with latencies, stage medians and failures of a played session. The first update is the
// cold one (cold_ms); latency_ms is over the others, or over it alone when there are no others.
void summarise(const PlayedSession& session, RunReport& run);

// update,observation_sequence,latency_ms,register_ms,invert_ms,rebuild_ms,encode_ms,active,
// contact_iterations,status: a heading and one row per observation sent, `update` counting them from 1. Times ms;
// active: slaves that carry a contact force. status is the estimate's, else the code of the error or
// "superseded"; the fields between are empty then.
std::string latency_csv(const PlayedSession& session);

// The convergence history of the last update, with cross-validation errors of the iterates that arrived.
// cross_of: error of one displacement field, nullopt without truth.
std::vector<TracePoint> trace_of(
    const PlayedSession& session,
    const std::function<std::optional<MeanStd>(const Points&)>& cross_of);

}  // namespace brainshift::client
