// SPDX-License-Identifier: GPL-3.0-or-later
// DescentLog: what every descent method does once per iteration beside its mathematics. It looks
// whether the caller asked to stop, records the iterate, hands it to on_iterate, and tests the
// paper's stop rule
//
//   mean_i |e_i^k - e_i^{k-1}| < relative_misfit_change mean_i |e_i^1|                     (eq. 17)
//
// where e^1 is the misfit before anything is estimated: the data themselves.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/core/error.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

class DescentLog {
 public:
  // The clock starts. Keeps references to config and options.
  DescentLog(const InversionConfig& config, const InversionOptions& options,
             const SparseData& data);

  // The error of stopped() when a stop was requested.
  Status check_stop() const;
  // An iterate: displacement, its misfit e and the contact of `system`. True when the inversion is
  // over, by the stop rule or by the limit on iterations.
  bool record(const Points& displacement, const Points& misfit,
              const contact::PenalisedSystem& system);
  // The gradient is zero at the last iterate: converged, whatever eq. 17 gives.
  void at_minimum();
  // The last iterate with status and reason; kNotFinite.
  Result<Estimate> finish();

 private:
  bool settled(const Points& misfit) const;

  const InversionConfig& config_;
  const InversionOptions& options_;
  Stopwatch watch_;
  Points previous_misfit_;
  Estimate estimate_;
};

}  // namespace brainshift::inversion
