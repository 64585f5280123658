// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/steepest_descent.hpp"

#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include "common/fem/sampling.hpp"
#include "common/inversion/data_check.hpp"

namespace brainshift::inversion {
namespace {

using contact::ActiveSet;

// K_p u = b_p for a changing active set; refactorises only when the set has changed.
class PenalisedSystem {
 public:
  explicit PenalisedSystem(const contact::ForwardModel& forward)
      : forward_(forward),
        penalised_(forward.factor().clone_analysis()),
        active_(static_cast<std::size_t>(forward.contact().num_slaves()), 0) {}

  const ActiveSet& active() const { return active_; }
  int refactorisations() const { return refactorisations_; }

  Status activate(const ActiveSet& active) {
    if (active == active_) return {};
    active_ = active;
    if (contact::count(active_) == 0) return {};
    fem::SymmetricMatrix k_p = forward_.stiffness();
    forward_.contact().add_stiffness(k_p, forward_.dofs(), active_);
    ++refactorisations_;
    return penalised_.refactorise(k_p);
  }

  // Homogeneous: K_p^-1 f, for adjoint and line search.
  Points solve(const Points& f) const {
    const fem::SparseCholesky& factor =
        contact::count(active_) > 0 ? penalised_ : forward_.factor();
    return forward_.dofs().expand(factor.solve(forward_.dofs().restrict_to(f)));
  }
  // With the contact load: K_p^-1 b_p.
  Points solve_with_gaps(const Points& b) const {
    Points b_p = b;
    forward_.contact().add_load(b_p, active_);
    return solve(b_p);
  }

 private:
  const contact::ForwardModel& forward_;
  fem::SparseCholesky penalised_;
  ActiveSet active_;
  int refactorisations_ = 0;
};

// d, A and W_e of one inversion.
class Misfit {
 public:
  Misfit(const SparseData& data, const fem::SamplingMatrix& sampling)
      : data_(data), sampling_(sampling), weights_(data.sd_mm.array().square().inverse()) {}

  Points sample(const Points& u) const { return (sampling_ * u.transpose()).transpose(); }
  Points residual(const Points& u) const { return data_.displacements - sample(u); }
  // A^T W_e r, 3 x n.
  Points adjoint(const Points& r) const {
    return (sampling_.transpose() * (r * weights_.asDiagonal()).transpose()).transpose();
  }
  // r . W_e s
  double inner(const Points& r, const Points& s) const {
    return (r.cwiseProduct(s) * weights_.asDiagonal()).sum();
  }

 private:
  const SparseData& data_;
  fem::SamplingMatrix sampling_;
  VecX weights_;
};

double inner(const Points& a, const Points& b) { return a.cwiseProduct(b).sum(); }

Result<Misfit> make_misfit(const PreparedModel& model, const SparseData& data) {
  auto sampling = fem::sampling_matrix(model.locator(), model.model().mesh.num_nodes(),
                                       data.positions, kOutsideTolerance_mm);
  if (!sampling) return tl::unexpected(sampling.error());
  return Misfit(data, *sampling);
}

// Penetration of the iterate, and the contact forces that its active set carries.
void summarise_contact(const contact::PenaltyContact& contact, const PenalisedSystem& system,
                       Estimate& estimate) {
  const VecX penetration = contact.penetration(estimate.displacement);
  estimate.contact = {};
  estimate.active_slaves.clear();
  std::vector<double> forces;
  for (int i = 0; i < contact.num_slaves(); ++i) {
    if (penetration[i] > kPenetrationTolerance_mm) ++estimate.contact.penetrating;
    estimate.contact.max_penetration_mm =
        std::max(estimate.contact.max_penetration_mm, penetration[i]);
    if (!system.active()[i]) continue;
    estimate.active_slaves.push_back(contact.pairs()[i].slave);
    forces.push_back(contact.beta() * penetration[i]);
  }
  estimate.contact_force_n =
      Eigen::Map<const VecX>(forces.data(), static_cast<Eigen::Index>(forces.size()));
  estimate.contact.active = static_cast<int>(forces.size());
  estimate.contact.iterations = system.refactorisations();
}

// Steps 1 and 2: one contact iteration.
Status forward_step(const contact::ForwardModel& forward, const Points& b, PenalisedSystem& system,
                    Points& u) {
  u = system.solve_with_gaps(b);
  const ActiveSet penetrating = forward.contact().penetrating(u);
  if (penetrating == system.active()) return {};
  if (auto status = system.activate(penetrating); !status) return status;
  u = system.solve_with_gaps(b);
  return {};
}

// Step 3's test (eq. 17): mean change of the misfit vectors since the previous iteration; never at the first.
bool misfit_settled(const Points& misfit, const Points& previous, const Estimate& estimate,
                    double relative_change) {
  if (previous.cols() == 0) return false;
  const double change = (misfit - previous).colwise().norm().mean();
  return change < relative_change * estimate.initial_misfit_mm.mean;
}

std::string stop_sentence(const Estimate& estimate, const InversionConfig& config) {
  std::ostringstream text;
  const auto iterations = estimate.history.size();
  if (estimate.status == EstimateStatus::kConverged) {
    text << "misfit changed by less than " << config.relative_misfit_change
         << " of its initial value at iteration " << iterations;
  } else {
    text << "iteration limit " << config.max_iterations << " reached before the misfit settled";
  }
  return text.str();
}

}  // namespace

Result<Estimate> steepest_descent(const PreparedModel& model, const SparseData& data,
                                  const InversionOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const contact::ForwardModel& forward = model.forward();
  const InversionConfig& config = model.config().inversion;
  auto misfit = make_misfit(model, data);
  if (!misfit) return tl::unexpected(misfit.error());
  PenalisedSystem system(forward);

  Estimate estimate;
  estimate.initial_misfit_mm = mean_std_of_norms(data.displacements);
  Points previous_misfit(3, 0);
  Points w = Points::Zero(3, model.model().mesh.num_nodes());
  Points b = w;
  for (int k = 1; k <= config.max_iterations; ++k) {
    if (options.stop.stop_requested()) {
      return fail(ErrorCode::kNotConverged,
                  "inversion was stopped at iteration " + std::to_string(k));
    }
    if (auto s = forward_step(forward, b, system, estimate.displacement); !s) {
      return tl::unexpected(s.error());
    }
    const Points e = misfit->residual(estimate.displacement);
    estimate.misfit_mm = mean_std_of_norms(e);
    summarise_contact(forward.contact(), system, estimate);
    const double elapsed_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    estimate.history.push_back({k, estimate.misfit_mm, estimate.contact.penetrating,
                                estimate.contact.max_penetration_mm, elapsed_ms});
    estimate.status = EstimateStatus::kIterating;
    if (options.on_iterate) options.on_iterate(estimate);
    if (misfit_settled(e, previous_misfit, estimate, config.relative_misfit_change)) {
      estimate.status = EstimateStatus::kConverged;
      break;
    }
    previous_misfit = e;
    if (k == config.max_iterations) break;

    const Points lambda = system.solve(2.0 * misfit->adjoint(e));
    const Points dw = lambda - 2.0 * w;
    const Points s = model.prior().apply(dw);
    const Points az = misfit->sample(system.solve(s));
    const double curvature = misfit->inner(az, az) + inner(s, dw);
    if (!(curvature > 0.0)) break;  // gradient is zero: the minimum
    const double alpha = (misfit->inner(e, az) - inner(b, dw)) / curvature;
    w += alpha * dw;
    b += alpha * s;
  }
  if (estimate.status != EstimateStatus::kConverged)
    estimate.status = EstimateStatus::kIterationLimit;
  if (!estimate.displacement.allFinite()) {
    return fail(ErrorCode::kNotFinite, "inversion: the displacement is not finite");
  }
  estimate.reason = stop_sentence(estimate, config);
  return estimate;
}

Result<Objective> evaluate_objective(const PreparedModel& model, const SparseData& data,
                                     const Points& w, const ActiveSet& active) {
  auto misfit = make_misfit(model, data);
  if (!misfit) return tl::unexpected(misfit.error());
  PenalisedSystem system(model.forward());
  if (auto status = system.activate(active); !status) return tl::unexpected(status.error());
  const Points b = model.prior().apply(w);
  const Points e = misfit->residual(system.solve_with_gaps(b));
  Objective objective;
  objective.value = misfit->inner(e, e) + inner(b, w);
  objective.gradient = 2.0 * w - system.solve(2.0 * misfit->adjoint(e));
  return objective;
}

}  // namespace brainshift::inversion
