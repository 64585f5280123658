// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_at_loads.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace brainshift::inversion {
namespace {

constexpr double kShortestStep = 1e-6;
// A search that knows no forces begins with the slaves that stand deeper in the skull than this
// part of the deepest: those that press keep many of the others off. (On the default head half of
// the slaves that penetrate without forces press in the end.)
constexpr double kFirstPart = 0.4;

}  // namespace

ContactAtLoads::ContactAtLoads(const CondensedOperators& operators, ModeWindow window, double beta,
                               bool contact, ContactSystem& system, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      contact_(contact),
      system_(system),
      team_(team),
      set_(static_cast<std::size_t>(operators.num_slaves()), 0),
      free_penetration_(operators.initial_penetration_mm),
      forces_(operators.num_slaves()),
      newton_penetration_(operators.num_slaves()),
      all_forces_(VecX::Zero(operators.num_slaves())),
      penetration_(operators.initial_penetration_mm),
      before_(VecX::Zero(operators.num_slaves())),
      penetration_before_(operators.num_slaves()),
      correction_(operators.num_slaves()) {
  active_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  corrected_.reserve(static_cast<std::size_t>(operators.num_slaves()));
  kept_.active.reserve(static_cast<std::size_t>(operators.num_slaves()));
  keep();
}

void ContactAtLoads::keep() {
  kept_.set = set_;
  kept_.active = active_;
  kept_.forces = forces_;
  kept_.penetration = penetration_;
  kept_.violation_mm = violation_mm_;
}

void ContactAtLoads::return_to_kept() {
  set_ = kept_.set;
  active_ = kept_.active;
  forces_ = kept_.forces;
  begin_from(active_, forces());
  penetration_ = kept_.penetration;
  violation_mm_ = kept_.violation_mm;
}

void ContactAtLoads::forget() {
  std::fill(set_.begin(), set_.end(), char{0});
  active_.clear();
  all_forces_.setZero();
}

void ContactAtLoads::begin_from(const std::vector<int>& slaves,
                                const Eigen::Ref<const VecX>& forces) {
  all_forces_.setZero();
  for (std::size_t j = 0; j < slaves.size(); ++j) {
    all_forces_[slaves[j]] = std::max(0.0, forces[static_cast<Eigen::Index>(j)]);
  }
}

Result<bool> ContactAtLoads::solve(const VecX& z, const std::function<bool()>& give_up) {
  const auto modes = operators_.slave_modes.middleCols(window_.first, window_.count);
  team_.split(free_penetration_.size(), [&](long begin, long end) {
    free_penetration_.segment(begin, end - begin).noalias() =
        operators_.initial_penetration_mm.segment(begin, end - begin) -
        modes.middleRows(begin, end - begin) * z;
  });
  sets_ = 0;
  violation_mm_ = 0.0;
  if (!contact_) {
    penetration_ = free_penetration_;
    return true;
  }
  begin_set();
  all_forces_.setZero();
  double value = std::numeric_limits<double>::infinity();
  while (sets_ < kMaxSets) {
    if (give_up && give_up()) return false;
    ++sets_;
    list_active(set_, active_);
    if (auto status = system_.take(set_); !status) return tl::unexpected(status.error());
    system_.solve(z, free_penetration_, forces_.head(size()), newton_penetration_);
    const bool all_press = size() == 0 || forces_.head(size()).minCoeff() >= 0.0;
    violation_mm_ = 0.0;
    for (std::size_t i = 0; i < set_.size(); ++i) {
      if (!set_[i]) {
        violation_mm_ = std::max(violation_mm_, newton_penetration_[static_cast<Eigen::Index>(i)]);
      }
    }
    const bool solved = all_press && violation_mm_ <= kContactViolation_mm;
    if (!solved && sets_ < kPlainSets) {
      exchange();
      continue;
    }
    before_ = all_forces_;
    penetration_before_ = penetration_;
    for (double step = 1.0;; step *= 0.5) {
      go(step);
      const double now = dual();
      if (!all_press && step >= kShortestStep && !(now < value)) continue;
      value = now;
      break;
    }
    if (solved) return true;
    follow(kContactViolation_mm);
  }
  return fail(ErrorCode::kNotConverged,
              "contact: the active set of fixed loads did not settle in " +
                  std::to_string(kMaxSets) + " sets");
}

// 1/2 f D f - p f with D f = p - P + f / beta; penetration_ is that of all_forces_.
double ContactAtLoads::dual() const {
  return -0.5 * all_forces_.dot(free_penetration_ + penetration_ - all_forces_ / beta_);
}

void ContactAtLoads::exchange() {
  for (std::size_t i = 0; i < set_.size(); ++i) {
    if (set_[i]) continue;
    set_[i] = newton_penetration_[static_cast<Eigen::Index>(i)] > kContactViolation_mm ? 1 : 0;
  }
  for (int j = 0; j < size(); ++j) {
    set_[static_cast<std::size_t>(active_[static_cast<std::size_t>(j)])] =
        forces_[j] >= 0.0 ? 1 : 0;
  }
}

void ContactAtLoads::follow(double deeper_mm) {
  for (std::size_t i = 0; i < set_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    set_[i] = all_forces_[row] > 0.0 || penetration_[row] > deeper_mm ? 1 : 0;
  }
}

// Slaves with a force need no penetration here: of few others each is the product of one column,
// because Phi is symmetric.
void ContactAtLoads::begin_set() {
  active_.clear();
  corrected_.clear();
  for (int slave = 0; slave < operators_.num_slaves(); ++slave) {
    (all_forces_[slave] > 0.0 ? active_ : corrected_).push_back(slave);
  }
  penetration_ = free_penetration_;
  if (active_.size() <= corrected_.size()) {
    auto forces = forces_.head(size());
    gather(all_forces_.data(), active_, forces.data());
    subtract_penetration(operators_, active_, forces, team_, penetration_);
  } else {
    team_.split(static_cast<long>(corrected_.size()), [&](long begin, long end) {
      for (long j = begin; j < end; ++j) {
        const int slave = corrected_[static_cast<std::size_t>(j)];
        penetration_[slave] -= operators_.compliance.col(slave).dot(all_forces_);
      }
    });
  }
  const double deepest = penetration_.size() > 0 ? penetration_.maxCoeff() : 0.0;
  follow(active_.empty() ? std::max(kContactViolation_mm, kFirstPart * deepest)
                         : kContactViolation_mm);
}

void ContactAtLoads::go(double step) {
  corrected_.clear();
  penetration_ = newton_penetration_;
  if (step < 1.0) penetration_ = penetration_before_ + step * (penetration_ - penetration_before_);
  all_forces_ = before_;  // of slaves that are not free, 0
  for (int j = 0; j < size(); ++j) {
    const int slave = active_[static_cast<std::size_t>(j)];
    const double force =
        step < 1.0 ? before_[slave] + step * (forces_[j] - before_[slave]) : forces_[j];
    all_forces_[slave] = std::max(0.0, force);
    if (force >= 0.0) continue;
    correction_[static_cast<Eigen::Index>(corrected_.size())] = -force;
    corrected_.push_back(slave);
  }
  subtract_penetration(operators_, corrected_, correction_, team_, penetration_);
}

Status ContactAtLoads::add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out) {
  if (auto status = system_.take(set_); !status) return status;
  system_.add_adjoint(felt, out);
  return {};
}

}  // namespace brainshift::inversion
