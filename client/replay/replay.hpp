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
#include "common/core/estimate.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct ReplayOptions {
  std::filesystem::path surgery;
  std::string endpoint = "tcp://127.0.0.1:5555";
  std::filesystem::path report;  // report.json to write; replaced if it exists
  Speed speed = Speed::kMax;
  std::vector<Boundary> boundaries = {Boundary::kContact, Boundary::kFixed};
  Method method = Method::kPaper;
  std::chrono::milliseconds timeout{
      600000};  // longest silence before an observation counts as lost
};

// Writes options.report and, beside it, per run with an estimate `<stem>-<scenario>-<boundary>.vtu` with the
// point arrays displacement_estimated and, where truth is recorded, displacement_true (mm, RAS, moves an
// undeformed point to its deformed place) and error_mm.
//
// kNotFound / kUnreadable name the surgery file; kInvalidArgument: the daemon holds another case or model
// than the surgery was recorded for; kUnavailable: no daemon; kModelNotReady: no model loaded there. The
// report is still written when observations fail; the status is then kNotConverged if some run received no
// successful update at all.
Status replay(const ReplayOptions& options, const Progress& progress = {});

// `run` completed with latencies, stage medians and failures of a played session.
void summarise(const PlayedSession& session, RunReport& run);

// The convergence history of the last update, with cross-validation errors of the iterates that arrived.
// cross_of: error of one displacement field, nullopt without truth.
std::vector<TracePoint> trace_of(
    const PlayedSession& session,
    const std::function<std::optional<MeanStd>(const Points&)>& cross_of);

}  // namespace brainshift::client
