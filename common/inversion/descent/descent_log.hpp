// SPDX-License-Identifier: GPL-3.0-or-later
// DescentLog: what every descent method does once per iteration beside its mathematics: look whether it is asked to
// stop, record the iterate, publish it, and test the paper's stop rule
//
//   mean_i |e_i^k - e_i^{k-1}| < relative_misfit_change mean_i |e_i^1|                              (eq. 17)
//
// where e^1 is the misfit before anything is estimated, the data themselves.
#pragma once

#include <chrono>
#include <string>

#include "common/values/case_config.hpp"
#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"
#include "common/inversion/invert.hpp"
#include "common/contact/penalised_system.hpp"

namespace brainshift::inversion {

class DescentLog {
 public:
  // The clock starts. Keeps references to config and options.
  DescentLog(const InversionConfig& config, const InversionOptions& options,
             const SparseData& data);

  // kNotConverged when a stop was requested.
  Status check_stop() const;
  // An iterate: displacement, its misfit e and the contact of `system`. True when the inversion is over, by the stop
  // rule or by the limit on iterations.
  bool record(const Points& displacement, const Points& misfit, const contact::PenalisedSystem& system);
  // The gradient is zero where the last iterate was taken: converged, whatever eq. 17 says.
  void at_minimum();
  // The last iterate with status and reason; kNotFinite.
  Result<Estimate> finish();

 private:
  bool settled(const Points& misfit) const;

  const InversionConfig& config_;
  const InversionOptions& options_;
  std::chrono::steady_clock::time_point start_;
  Points previous_misfit_;
  Estimate estimate_;
};

}  // namespace brainshift::inversion
