// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/descent_log.hpp"

#include <sstream>
#include <utility>
#include <vector>

#include "common/inversion/contract/estimate_check.hpp"

namespace brainshift::inversion {
namespace {

// Penetration of the iterate, and the contact forces that its active set carries.
void summarise_contact(const contact::PenalisedSystem& system, Estimate& estimate) {
  const contact::PenaltyContact& contact = system.forward().contact();
  const VecX penetration = contact.penetration(estimate.displacement);
  const PenetrationSummary summary = summarise_penetration(penetration);
  estimate.active_slaves.clear();
  std::vector<double> forces;
  for (int i = 0; i < contact.num_slaves(); ++i) {
    if (!system.active()[i]) continue;
    estimate.active_slaves.push_back(contact.pairs()[i].slave);
    forces.push_back(contact.beta() * penetration[i]);
  }
  estimate.contact_force_n =
      Eigen::Map<const VecX>(forces.data(), static_cast<Eigen::Index>(forces.size()));
  estimate.contact = {static_cast<int>(forces.size()), summary.penetrating, summary.max_mm,
                      system.changes()};
}

}  // namespace

DescentLog::DescentLog(const InversionConfig& config, const InversionOptions& options,
                       const SparseData& data)
    : config_(config), options_(options), previous_misfit_(3, 0) {
  estimate_.initial_misfit_mm = mean_std_of_norms(data.displacements);
}

Status DescentLog::check_stop() const {
  if (!options_.stop.stop_requested()) return {};
  return stopped(static_cast<int>(estimate_.history.size()) + 1);
}

// Never at the first iteration.
bool DescentLog::settled(const Points& misfit) const {
  if (previous_misfit_.cols() == 0) return false;
  const double change = (misfit - previous_misfit_).colwise().norm().mean();
  return change < config_.relative_misfit_change * estimate_.initial_misfit_mm.mean;
}

bool DescentLog::record(const Points& displacement, const Points& misfit,
                        const contact::PenalisedSystem& system) {
  const int k = static_cast<int>(estimate_.history.size()) + 1;
  estimate_.displacement = displacement;
  estimate_.misfit_mm = mean_std_of_norms(misfit);
  summarise_contact(system, estimate_);
  estimate_.history.push_back({k, estimate_.misfit_mm, estimate_.contact.penetrating,
                               estimate_.contact.max_penetration_mm, watch_.milliseconds()});
  estimate_.status = EstimateStatus::kIterating;
  if (options_.on_iterate) options_.on_iterate(estimate_);

  std::ostringstream reason;
  if (settled(misfit)) {
    estimate_.status = EstimateStatus::kConverged;
    reason << "misfit changed by less than " << config_.relative_misfit_change
           << " of its initial value at iteration " << k;
  } else if (k >= config_.max_iterations) {
    estimate_.status = EstimateStatus::kIterationLimit;
    reason << "iteration limit " << config_.max_iterations << " reached before the misfit settled";
  }
  estimate_.reason = reason.str();
  previous_misfit_ = misfit;
  return estimate_.status != EstimateStatus::kIterating;
}

void DescentLog::at_minimum() {
  estimate_.status = EstimateStatus::kConverged;
  estimate_.reason =
      "the gradient is zero at iteration " + std::to_string(estimate_.history.size());
}

Result<Estimate> DescentLog::finish() {
  if (!estimate_.displacement.allFinite()) {
    return fail(ErrorCode::kNotFinite, "inversion: the displacement is not finite");
  }
  return std::move(estimate_);
}

}  // namespace brainshift::inversion
