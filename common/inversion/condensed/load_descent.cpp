// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/load_descent.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/inversion/contract/inversion_options.hpp"

namespace brainshift::inversion {
namespace {

// Armijo's fraction of the fall that the gradient promises; on an edge, of what the bundle
// promises.
constexpr double kSufficient = 1e-4;
constexpr double kSufficientOfBundle = 0.1;
// Trials in a row without a fall that change the direction; later ones shorten the step.
constexpr int kMaxTurns = 4;
constexpr int kMaxTurnsOfBundle = 16;
constexpr double kShortestStep = 1e-6;
// Slaves that may change on the first step of a descent: so many, or this part of those that are
// active. On the way to a mean half of them, and after steps that did not fall at least kFewest.
constexpr int kFewSlaves = 64;
constexpr int kPartOfSlaves = 5;
constexpr int kFewestSlaves = 16;
// Farther from the minimum than this, a new linear model is worth its price.
constexpr double kFar = 1.0;
// Steps from afar that are shorter than this zigzag across an edge.
constexpr double kShort = 0.1;

Result<EstimateStatus> given_up(const DescentLimits& limits, int step) {
  if (limits.stop.stop_requested()) return stopped(step);
  return EstimateStatus::kDeadline;
}

}  // namespace

LoadDescent::LoadDescent(const CondensedOperators& operators, ModeWindow window, double beta,
                         bool contact, ThreadTeam& team, UpdateProfile& profile)
    : window_(window),
      team_(team),
      profile_(profile),
      system_(operators, window, beta, team),
      reduction_(operators, window, system_, team),
      contact_(operators, window, beta, contact, system_, team),
      reach_(operators, window, beta, contact, reduction_, team),
      posterior_(window),
      z_(VecX::Zero(window.count)),
      trial_(window.count),
      step_(window.count),
      gradient_(window.count),
      shift_(SparseData::kMaxCommonErrors + window.count),
      mean_z_(VecX::Zero(window.count)),
      predicted_(operators.num_slaves()),
      penetration_(operators.num_slaves()),
      newton_(window.count),
      next_(window.count),
      direction_(window.count),
      change_(window.count),
      curvature_(window.count),
      bundle_(window.count),
      covariance_factor_(window.count, window.count) {}

void LoadDescent::forget() {
  z_.setZero();
  contact_at_z_ = contact_kept_ = has_loads_ = false;
  contact_.forget();
  reduction_.forget();
  system_.forget();
}

double LoadDescent::objective(SampledOperators& sampled, const PriorStrengths& strengths,
                              const VecX& z) {
  double sum = 0.0;
  for (int i = 0; i < window_.count; ++i) {
    const double s = strengths.scale_of(i);
    if (s > 0.0) sum += z[i] * z[i] / (s * s);
  }
  return misfit(sampled, strengths, z) + 0.5 * sum;
}

Status LoadDescent::minimise(const PriorStrengths& strengths) {
  const StageClock clock(profile_, UpdateStage::kMinimise);
  return posterior_.minimise(strengths);
}

double LoadDescent::misfit(SampledOperators& sampled, const PriorStrengths& strengths,
                           const VecX& z) {
  const StageClock clock(profile_, UpdateStage::kGradient);
  const auto free_body = sampled.free_body();
  const int q = sampled.common();
  whitened_ = free_body.col(q + window_.count);
  whitened_.noalias() -= free_body.middleCols(q, window_.count) * z;
  if (contact_.size() > 0) {
    sampled.subtract_contact(contact_.active(), contact_.forces(), whitened_);
  }
  double sum = whitened_.squaredNorm();
  if (q > 0) {
    common_sd_.resize(q);
    for (int k = 0; k < q; ++k) common_sd_[k] = posterior_.common_sd(k, strengths.held_error());
    // Contact does not touch the common errors.
    normal_ = posterior_.gram().topLeftCorner(q, q);
    normal_.array().colwise() *= common_sd_.array();
    normal_.array().rowwise() *= common_sd_.transpose().array();
    normal_.diagonal().array() += 1.0;
    right_.noalias() = free_body.leftCols(q).transpose() * whitened_;
    right_.array() *= common_sd_.array();
    common_amplitudes_ = right_;
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(normal_);
    factor.solveInPlace(common_amplitudes_);
    sum -= right_.dot(common_amplitudes_);
    common_amplitudes_.array() *= common_sd_.array();
  }
  return 0.5 * sum;
}

Status LoadDescent::newton_step(SampledOperators& sampled, const PriorStrengths& strengths) {
  const StageClock clock(profile_, UpdateStage::kGradient);
  const auto free_body = sampled.free_body();
  const int q = sampled.common();
  adjoint_ = whitened_;  // R^-1/2 (d - A u - common error)
  if (q > 0) adjoint_.noalias() -= free_body.leftCols(q) * common_amplitudes_;
  gradient_.noalias() = -free_body.middleCols(q, window_.count).transpose() * adjoint_;
  if (contact_.size() > 0) {
    felt_.resize(contact_.size());
    sampled.contact_transposed(contact_.active(), adjoint_, felt_);
    if (auto status = contact_.add_adjoint(felt_, gradient_); !status) return status;
  }
  for (int i = 0; i < window_.count; ++i) {
    const double s = strengths.scale_of(i);
    gradient_[i] = s > 0.0 ? gradient_[i] + trial_[i] / (s * s) : 0.0;
  }
  posterior_.whitened_newton_step(gradient_, next_);
  return {};
}

Result<bool> LoadDescent::solve_contact(const VecX& z, const std::function<bool()>& give_up) {
  const StageClock clock(profile_, UpdateStage::kContact);
  auto forces = predicted_.head(reduction_.size());
  reduction_.forces_at(z, forces);
  contact_.begin_from(reduction_.active(), forces);
  contact_at_z_ = false;
  return contact_.solve(z, give_up);
}

Status LoadDescent::return_contact() {
  if (contact_at_z_) return {};
  if (contact_kept_) {
    contact_.return_to_kept();
  } else {
    if (auto solved = solve_contact(z_); !solved) return tl::unexpected(solved.error());
    contact_.keep();
  }
  contact_at_z_ = contact_kept_ = true;
  return {};
}

void LoadDescent::accept_trial() {
  z_ = trial_;
  contact_.keep();
  contact_at_z_ = contact_kept_ = has_loads_ = true;
}

Status LoadDescent::linearise(SampledOperators& sampled, bool same_data) {
  const StageClock clock(profile_, UpdateStage::kLinearise);
  if (auto status = reduction_.activate(contact_.set()); !status) return status;
  posterior_.linearise(sampled, reduction_, same_data, team_);
  return {};
}

double LoadDescent::reach(const VecX& penetration, int most) {
  const StageClock clock(profile_, UpdateStage::kReach);
  return reach_.along(step_, penetration, most);
}

int LoadDescent::most_changes() const {
  return std::max(kFewSlaves, reduction_.size() / kPartOfSlaves);
}

// More slaves than an edge brings into play have changed.
bool LoadDescent::far_from_model() const {
  int changes = 0;
  for (std::size_t i = 0; i < contact_.set().size(); ++i) {
    changes += contact_.set()[i] != reduction_.set()[i] ? 1 : 0;
  }
  return changes > std::max(6, reduction_.size() / 20);
}

Result<bool> LoadDescent::jump(SampledOperators& sampled, const PriorStrengths& strengths,
                               const DescentLimits& limits) {
  if (auto status = minimise(strengths); !status) return tl::unexpected(status.error());
  trial_ = posterior_.z();
  const auto solved = solve_contact(trial_, [this, &limits] {
    return has_loads_ ? limits.over() : limits.stop.stop_requested();
  });
  if (!solved) return solved;
  if (*solved) {
    accept_trial();
  } else if (limits.stop.stop_requested()) {
    return stopped(1);
  }
  if (auto status = return_contact(); !status) return tl::unexpected(status.error());
  if (contact_.set() != reduction_.set()) {
    if (auto status = linearise(sampled); !status) return tl::unexpected(status.error());
  }
  return *solved;
}

Status LoadDescent::take(SampledOperators& sampled) {
  if (auto status = return_contact(); !status) return status;
  return linearise(sampled, false);
}

Status LoadDescent::begin(SampledOperators& sampled, const PriorStrengths& strengths) {
  if (auto status = return_contact(); !status) return status;
  value_ = objective(sampled, strengths, z_);
  if (auto status = minimise(strengths); !status) return status;
  step_ = posterior_.z() - z_;
  posterior_.whiten(step_, newton_);
  return {};
}

Result<bool> LoadDescent::attempt(SampledOperators& sampled, const PriorStrengths& strengths,
                                  const VecX& whitened, const DescentLimits& limits) {
  posterior_.unwhiten(whitened, step_);
  trial_ = z_ + step_;
  const auto solved = solve_contact(trial_, [&limits] { return limits.over(); });
  if (!solved || !*solved) return solved;
  after_ = objective(sampled, strengths, trial_);
  if (auto ok = newton_step(sampled, strengths); !ok) return tl::unexpected(ok.error());
  return true;
}

Result<EstimateStatus> LoadDescent::descend(SampledOperators& sampled,
                                            const PriorStrengths& strengths, bool fine,
                                            const DescentLimits& limits) {
  auto outcome = descend_smoothly(sampled, strengths, kRoughDecrement, limits);
  if (outcome && fine && *outcome == EstimateStatus::kConverged) {
    outcome = descend_to_edge(sampled, strengths, limits);
    if (outcome && *outcome == EstimateStatus::kIterationLimit) {
      outcome = descend_smoothly(sampled, strengths, kDecrement, limits);
    }
  }
  if (!outcome) return outcome;
  if (auto status = return_contact(); !status) return tl::unexpected(status.error());
  if (contact_.set() != reduction_.set()) {
    if (auto status = linearise(sampled); !status) return tl::unexpected(status.error());
    if (auto status = minimise(strengths); !status) return tl::unexpected(status.error());
  }
  return outcome;
}

Result<EstimateStatus> LoadDescent::descend_smoothly(SampledOperators& sampled,
                                                     const PriorStrengths& strengths,
                                                     double tolerance,
                                                     const DescentLimits& limits) {
  if (auto status = begin(sampled, strengths); !status) return tl::unexpected(status.error());
  curvature_.reset();
  penetration_ = contact_.penetration();
  int turns = 0, most = most_changes();
  double fall = 0.0, longest = 1.0, length = longest;  // longest: of this direction
  for (int step = 0; step < limits.max_steps && length > kShortestStep; ++step) {
    if (limits.stop.stop_requested()) return stopped(step + 1);
    if (length == longest) {
      curvature_.apply(newton_, direction_);
      fall = std::max(0.0, direction_.dot(newton_));
      decrement_ = std::sqrt(fall);
      if (decrement_ <= tolerance) return EstimateStatus::kConverged;
      posterior_.unwhiten(direction_, step_);
      length = longest = reach(penetration_, most);
    }
    change_ = length * direction_;
    const auto tried = attempt(sampled, strengths, change_, limits);
    if (!tried) return tl::unexpected(tried.error());
    if (!*tried) return given_up(limits, step + 1);
    const bool fell = after_ <= value_ - kSufficient * length * fall;
    if (fell) {
      penetration_ = contact_.penetration();
      if (length == longest && longest < 1.0) most *= 2;
    } else {
      most = std::max(most / 2, kFewestSlaves);
    }
    if (fell && decrement_ > kFar && far_from_model()) {
      accept_trial();
      length = longest = 1.0;
      turns = 0;
      if (auto status = linearise(sampled); !status) return tl::unexpected(status.error());
      if (auto status = begin(sampled, strengths); !status) return tl::unexpected(status.error());
      curvature_.reset();
    } else {
      bool learned = false;
      if (decrement_ <= kFar || length < kShort) {
        newton_ -= next_;  // change of the gradient
        learned = curvature_.learn(change_, newton_);
        newton_ += next_;
      }
      if (fell) {
        accept_trial();
        value_ = after_;
        newton_ = next_;
        length = longest = 1.0;
        turns = 0;
      } else if (learned && length == longest && turns < kMaxTurns) {
        ++turns;
        length = longest = 1.0;
      } else {
        const double fitted = 0.5 * length * length * fall / (after_ - value_ + length * fall);
        length = std::clamp(fitted, 0.1 * length, 0.5 * length);
      }
    }
    limits.on_step();
    if (limits.out_of_time()) return EstimateStatus::kDeadline;
  }
  return EstimateStatus::kIterationLimit;
}

Result<EstimateStatus> LoadDescent::descend_to_edge(SampledOperators& sampled,
                                                    const PriorStrengths& strengths,
                                                    const DescentLimits& limits) {
  if (auto status = return_contact(); !status) return tl::unexpected(status.error());
  if (contact_.set() != reduction_.set()) {
    if (auto status = linearise(sampled); !status) return tl::unexpected(status.error());
  }
  if (auto status = begin(sampled, strengths); !status) return tl::unexpected(status.error());
  bundle_.clear();
  bundle_.add_here(newton_);
  int turns = 0;
  double length = 1.0;
  for (int step = 0; step < limits.max_steps && length > kShortestStep; ++step) {
    if (limits.stop.stop_requested()) return stopped(step + 1);
    bundle_.solve();
    decrement_ = std::sqrt(2.0 * std::max(0.0, bundle_.fall()));
    if (decrement_ <= kDecrement) return EstimateStatus::kConverged;
    change_ = length * bundle_.step();
    const auto tried = attempt(sampled, strengths, change_, limits);
    if (!tried) return tl::unexpected(tried.error());
    if (!*tried) return given_up(limits, step + 1);
    if (after_ <= value_ - kSufficientOfBundle * length * bundle_.fall()) {
      accept_trial();
      bundle_.move(change_, value_ - after_);
      bundle_.add_here(next_);
      value_ = after_;
      length = 1.0;
      turns = 0;
    } else {
      const bool kept = bundle_.add_at(change_, after_ - value_, next_);
      if (!kept || ++turns > kMaxTurnsOfBundle) length *= 0.5;
    }
    limits.on_step();
    if (limits.out_of_time()) return EstimateStatus::kDeadline;
  }
  return EstimateStatus::kIterationLimit;
}

Result<bool> LoadDescent::average(SampledOperators& sampled, PriorStrengths& strengths,
                                  const DescentLimits& limits) {
  auto shift = shift_.head(posterior_.unknowns());
  bool finite = false;
  {
    const StageClock clock(profile_, UpdateStage::kHypotheses);
    finite = strengths.mean_shift(shift);
  }
  if (!finite) {
    return fail(ErrorCode::kNotFinite, "inversion: the mean over the hypotheses is not finite");
  }
  if (auto status = return_contact(); !status) return tl::unexpected(status.error());
  const double most_probable = misfit(sampled, strengths, z_);
  step_ = shift.tail(window_.count);
  const bool moves = (step_.array() != 0.0).any();
  bool in_time = !moves || !limits.over();
  double length = moves && in_time ? reach(contact_.penetration(), most_changes() / 2) : 0.0;
  for (; length >= kShortestStep; length *= 0.5) {
    mean_z_ = z_ + length * step_;
    const auto solved = solve_contact(mean_z_, [&limits] { return limits.over(); });
    if (!solved) return solved;
    in_time = *solved;
    if (!in_time) length = 0.0;
    if (in_time && misfit(sampled, strengths, mean_z_) <= most_probable + kLostByMean) break;
  }
  if (limits.stop.stop_requested()) return stopped(1);
  if (length < kShortestStep) {
    length = 0.0;
    mean_z_ = z_;
    if (auto status = return_contact(); !status) return tl::unexpected(status.error());
  }
  posterior_.set_answer(length * shift.head(posterior_.unknowns() - window_.count), mean_z_);
  return in_time;
}

Status LoadDescent::spread(PriorStrengths& strengths) {
  const StageClock clock(profile_, UpdateStage::kHypotheses);
  if (strengths.covariance(covariance_factor_)) return {};
  return fail(ErrorCode::kNotFinite, "inversion: the covariance is not positive definite");
}

}  // namespace brainshift::inversion
