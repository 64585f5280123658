// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/run_unit.hpp"

#include <fmt/format.h>

#include "common/contact/forward_model.hpp"
#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::client {
namespace {

bool is_local(const std::string& endpoint) {
  for (const char* start : {"ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"}) {
    if (endpoint.rfind(start, 0) == 0) return true;
  }
  return false;
}

}  // namespace

Result<RunUnit> measure_run_unit(const std::string& endpoint, const DaemonStatus& daemon,
                                 const BrainModel& model, const std::filesystem::path& case_file,
                                 Boundary boundary) {
  if (!is_local(endpoint)) {
    return fail(ErrorCode::kUnavailable, endpoint + ": the daemon may be on another machine");
  }
  if (const std::string own = linalg::blas_kernel(); own != daemon.blas_kernel) {
    return fail(ErrorCode::kUnavailable,
                fmt::format("OpenBLAS kernel {} here, {} in the daemon", own, daemon.blas_kernel));
  }
  const auto config = io::read_case_config(case_file);
  if (!config) return tl::unexpected(config.error());
  linalg::use_single_threaded_blas();
  const auto forward = contact::ForwardModel::build(model, *config, boundary);
  if (!forward) return tl::unexpected(forward.error());
  return RunUnit{forward->factor().factor_seconds(), contact::measure_full_solve_ms(*forward)};
}

}  // namespace brainshift::client
