// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/set_search.hpp"

#include <algorithm>
#include <limits>

namespace brainshift::inversion {
namespace {

// FNV-1a over the flags.
std::uint64_t hash_of(const contact::ActiveSet& set) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char flag : set) hash = (hash ^ static_cast<unsigned char>(flag)) * 1099511628211ULL;
  return hash;
}

}  // namespace

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
  cycled_ = false;
}

void SetSearch::forget() { std::fill(current_.begin(), current_.end(), char{0}); }

bool SetSearch::seen_before() {
  const std::uint64_t hash = hash_of(current_);
  if (std::find(visited_.begin(), visited_.end(), hash) != visited_.end()) return true;
  visited_.push_back(hash);
  return false;
}

SetSearch::Step SetSearch::next(const VecX& forces, const VecX& penetration,
                                const VecX& compliance_diagonal) {
  ++iteration_;
  double violation = 0.0;
  std::size_t first = current_.size();
  for (std::size_t i = 0; i < current_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double here = current_[i] ? -forces[row] * compliance_diagonal[row] : penetration[row];
    if (!(here > 0.0)) continue;
    violation = std::max(violation, here);
    if (here > tolerance_mm_) first = std::min(first, i);  // smaller ones do no harm
  }
  if (violation <= tolerance_mm_) return Step::kSolved;
  if (violation < best_violation_mm_) {
    best_violation_mm_ = violation;
    best_ = current_;
  }
  if (iteration_ >= max_iterations_) return Step::kExhausted;
  if (!cycled_ && seen_before()) cycled_ = true;
  if (cycled_) {
    current_[first] = static_cast<char>(!current_[first]);
    return Step::kContinue;
  }
  for (std::size_t i = 0; i < current_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    current_[i] = static_cast<char>(current_[i] ? forces[row] >= 0.0 : penetration[row] > 0.0);
  }
  return Step::kContinue;
}

}  // namespace brainshift::inversion
