// SPDX-License-Identifier: GPL-3.0-or-later
// The default head, prepared once, and the daemon's pipeline on it without the daemon.
#pragma once

#include "client/tools/replay/run_report.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/pipeline/pipeline.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::sensing {

// Contact boundary. `thousand_nodes`: wanted size of the mesh. Prints how long it took.
Result<bench::Head> make_default_head(double thousand_nodes);

// The pipeline of the daemon's default session on this head: method condensed, with the
// evidence of the other sources.
Result<pipeline::Pipeline> begin_surgery(const bench::Head& head, const CaseConfig& config);

// Errors and coverage of an update; the truth is read here only.
Result<client::RunReport> score_update(const bench::Head& head, const io::SurgeryTruth& truth,
                                       const Update& update);

}  // namespace brainshift::sensing
