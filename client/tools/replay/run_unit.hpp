// SPDX-License-Identifier: GPL-3.0-or-later
// RunUnit: t_solve, the unit of a run's times (contact::measure_full_solve_ms), measured by the
// program that plays the run, on the daemon's machine and after its last update. The model comes
// from the daemon, the material from the case file that the surgery names. Takes a factorisation
// and ten solves: three seconds and 0.4 GiB for 18 thousand nodes.
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/session.hpp"

namespace brainshift::client {

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
