// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/set_search.hpp"

#include <algorithm>
#include <limits>

#include "common/core/fnv1a.hpp"

namespace brainshift::contact {

SetSearch::SetSearch(int slaves, int max_iterations, double tolerance_mm)
    : current_(static_cast<std::size_t>(slaves), 0),
      best_(current_),
      max_iterations_(max_iterations),
      tolerance_mm_(tolerance_mm) {
  visited_.reserve(static_cast<std::size_t>(max_iterations));
}

void SetSearch::begin() {
  visited_.clear();
  best_ = current_;
  best_violation_mm_ = std::numeric_limits<double>::infinity();
  iteration_ = 0;
  without_gain_ = 0;
  cycled_ = false;
}

void SetSearch::forget() { std::fill(current_.begin(), current_.end(), char{0}); }

bool SetSearch::seen_before() {
  const std::uint64_t hash = fnv1a({current_.data(), current_.size()});
  if (std::find(visited_.begin(), visited_.end(), hash) != visited_.end()) return true;
  visited_.push_back(hash);
  return false;
}

double SetSearch::violation(std::size_t slave, const VecX& forces, const VecX& penetration,
                            const VecX& compliance_diagonal) const {
  const auto row = static_cast<Eigen::Index>(slave);
  return current_[slave] ? -forces[row] * compliance_diagonal[row] : penetration[row];
}

void SetSearch::pivot(const VecX& forces, const VecX& penetration,
                      const VecX& compliance_diagonal) {
  for (std::size_t i = 0; i < current_.size(); ++i) {
    if (!(violation(i, forces, penetration, compliance_diagonal) > tolerance_mm_)) continue;
    current_[i] = static_cast<char>(!current_[i]);
    return;
  }
}

SetSearch::Step SetSearch::next(const VecX& forces, const VecX& penetration,
                                const VecX& compliance_diagonal) {
  ++iteration_;
  double violation = 0.0;
  for (std::size_t i = 0; i < current_.size(); ++i) {
    violation = std::max(violation, this->violation(i, forces, penetration, compliance_diagonal));
  }
  solved_ = violation <= tolerance_mm_;
  if (solved_) return Step::kSolved;
  ++without_gain_;
  if (violation < best_violation_mm_) {
    without_gain_ = 0;
    best_violation_mm_ = violation;
    best_ = current_;
  }
  if (iteration_ >= max_iterations_) return Step::kExhausted;
  if (!cycled_ && seen_before()) cycled_ = true;
  if (cycled_) {
    const bool enough = without_gain_ >= kPatience && best_violation_mm_ <= kHolds_mm;
    return enough ? Step::kExhausted : Step::kCycling;
  }
  follow(forces, penetration);
  return Step::kContinue;
}

bool SetSearch::follow(const VecX& forces, const VecX& penetration) {
  bool changed = false;
  for (std::size_t i = 0; i < current_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const bool next = current_[i] ? forces[row] >= 0.0 : penetration[row] > 0.0;
    changed = changed || next != (current_[i] != 0);
    current_[i] = static_cast<char>(next);
  }
  return changed;
}

}  // namespace brainshift::contact
