// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/descents.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/descent/objective.hpp"

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

// DescentLog: what every descent method does once per iteration beside its mathematics. It looks
// whether the caller asked to stop, records the iterate, hands it to on_iterate, and tests the
// paper's stop rule
//
//   mean_i |e_i^k - e_i^{k-1}| < relative_misfit_change mean_i |e_i^1|                     (eq. 17)
//
// where e^1 is the misfit before anything is estimated: the data themselves.
class DescentLog {
 public:
  // The clock starts. Keeps references to config and options.
  DescentLog(const InversionConfig& config, const InversionOptions& options, const SparseData& data)
      : config_(config), options_(options), previous_misfit_(3, 0) {
    estimate_.initial_misfit_mm = mean_std_of_norms(data.displacements);
  }

  // The error of stopped() when a stop was requested.
  Status check_stop() const {
    if (!options_.stop.stop_requested()) return {};
    return stopped(static_cast<int>(estimate_.history.size()) + 1);
  }

  // An iterate: displacement, its misfit e and the contact of `system`. True when the inversion is
  // over, by the stop rule or by the limit on iterations.
  bool record(const Points& displacement, const Points& misfit,
              const contact::PenalisedSystem& system) {
    const int k = static_cast<int>(estimate_.history.size()) + 1;
    estimate_.displacement = displacement;
    estimate_.misfit_mm = mean_std_of_norms(misfit);
    summarise_contact(system, estimate_);
    estimate_.history.push_back({k, estimate_.misfit_mm, estimate_.contact.penetrating,
                                 estimate_.contact.max_penetration_mm, watch_.milliseconds()});
    estimate_.status = EstimateStatus::kIterating;
    if (options_.on_iterate) options_.on_iterate(estimate_);

    estimate_.reason.clear();
    if (settled(misfit)) {
      estimate_.status = EstimateStatus::kConverged;
      estimate_.reason =
          fmt::format("misfit changed by less than {:g} of its initial value at iteration {}",
                      config_.relative_misfit_change, k);
    } else if (k >= config_.max_iterations) {
      estimate_.status = EstimateStatus::kIterationLimit;
      estimate_.reason = fmt::format("iteration limit {} reached before the misfit settled",
                                     config_.max_iterations);
    }
    previous_misfit_ = misfit;
    return estimate_.status != EstimateStatus::kIterating;
  }

  // The gradient is zero at the last iterate: converged, whatever eq. 17 gives.
  void at_minimum() {
    estimate_.status = EstimateStatus::kConverged;
    estimate_.reason =
        "the gradient is zero at iteration " + std::to_string(estimate_.history.size());
  }

  // The last iterate with status and reason; kNotFinite.
  Result<Estimate> finish() {
    if (!estimate_.displacement.allFinite()) {
      return fail(ErrorCode::kNotFinite, "inversion: the displacement is not finite");
    }
    return std::move(estimate_);
  }

 private:
  // Never at the first iteration.
  bool settled(const Points& misfit) const {
    if (previous_misfit_.cols() == 0) return false;
    const double change = (misfit - previous_misfit_).colwise().norm().mean();
    return change < config_.relative_misfit_change * estimate_.initial_misfit_mm.mean;
  }

  const InversionConfig& config_;
  const InversionOptions& options_;
  Stopwatch watch_;
  Points previous_misfit_;
  Estimate estimate_;
};

// dw and s = Sigma dw, each conjugate to the one before.
class Direction {
 public:
  const Points& dw() const { return dw_; }
  const Points& s() const { return s_; }

  // r: negative gradient.
  void update(const prior::ForcePrior& prior, const Points& r, bool restart) {
    Points sigma_r = prior.apply(r);
    const double norm2 = inner(r, sigma_r);
    double gamma = 0.0;
    if (!restart && norm2_ > 0.0) gamma = std::max(0.0, (norm2 - inner(r, sigma_r_)) / norm2_);
    if (gamma > 0.0) {
      dw_ = r + gamma * dw_;
      s_ = sigma_r + gamma * s_;
    } else {
      dw_ = r;
      s_ = sigma_r;
    }
    norm2_ = norm2;
    sigma_r_ = std::move(sigma_r);
  }

 private:
  Points dw_, s_, sigma_r_;
  double norm2_ = 0.0;  // r . Sigma r
};

}  // namespace

Result<Estimate> steepest_descent(const PreparedModel& model, const SparseData& data,
                                  const InversionOptions& options,
                                  contact::PenalisedSystem& system) {
  DescentLog log(model.config().inversion, options, data);
  const auto misfit = Misfit::build(model, data);
  if (!misfit) return tl::unexpected(misfit.error());

  Points w = Points::Zero(3, model.model().mesh.num_nodes());
  Points b = w;
  Points u, lambda, dw, z;
  while (true) {
    if (auto s = log.check_stop(); !s) return tl::unexpected(s.error());
    if (auto s = system.solve_with_gaps(b, u); !s) return tl::unexpected(s.error());
    if (auto s = system.follow_contact(b, u); !s) return tl::unexpected(s.error());
    const Points e = misfit->residual(u);
    if (log.record(u, e, system)) break;

    if (auto s = negative_gradient(system, *misfit, e, w, lambda, dw); !s) {
      return tl::unexpected(s.error());
    }
    const Points s = model.prior().apply(dw);
    if (auto status = system.solve(s, z); !status) return tl::unexpected(status.error());
    const auto alpha = exact_step(*misfit, e, misfit->sample(z), b, s, dw);
    if (!alpha) return tl::unexpected(alpha.error());
    if (*alpha == 0.0) {
      log.at_minimum();
      break;
    }
    w += *alpha * dw;
    b += *alpha * s;
  }
  return log.finish();
}

Result<Estimate> conjugate_gradients(const PreparedModel& model, const SparseData& data,
                                     const InversionOptions& options,
                                     contact::PenalisedSystem& system) {
  DescentLog log(model.config().inversion, options, data);
  const auto misfit = Misfit::build(model, data);
  if (!misfit) return tl::unexpected(misfit.error());

  Points w = Points::Zero(3, model.model().mesh.num_nodes());
  Points b = w;
  Points u, lambda, r, z;
  Direction direction;
  if (auto s = system.solve_with_gaps(b, u); !s) return tl::unexpected(s.error());
  while (true) {
    if (auto s = log.check_stop(); !s) return tl::unexpected(s.error());
    const auto changed = system.follow_contact(b, u);
    if (!changed) return tl::unexpected(changed.error());
    const Points e = misfit->residual(u);
    if (log.record(u, e, system)) break;

    if (auto s = negative_gradient(system, *misfit, e, w, lambda, r); !s) {
      return tl::unexpected(s.error());
    }
    direction.update(model.prior(), r, *changed);
    if (auto s = system.solve(direction.s(), z); !s) return tl::unexpected(s.error());
    const auto alpha = exact_step(*misfit, e, misfit->sample(z), b, direction.s(), direction.dw());
    if (!alpha) return tl::unexpected(alpha.error());
    if (*alpha == 0.0) {
      log.at_minimum();
      break;
    }
    w += *alpha * direction.dw();
    b += *alpha * direction.s();
    u += *alpha * z;
  }
  return log.finish();
}

}  // namespace brainshift::inversion
