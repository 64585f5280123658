// SPDX-License-Identifier: GPL-3.0-or-later
// SetSearch: which slaves are active, found by a primal-dual active set (Hintermueller, Ito, Kunisch 2002).
//
// next() looks at the solution for the current set A: active slaves that pull (f < 0) leave, open slaves that
// penetrate (P > 0) join. Nothing violated by more than the tolerance: solved. A set seen before is a cycle: the loads
// depend on the set, and the sets of a cycle call for one another. From then on the caller chooses the next set by
// follow(), from a mean of their loads, or by pivot(). The set of least violation is kept as the best; when it has not become better
// for kPatience sets of a cycle, the search is exhausted. Does not allocate after construction.
#pragma once

#include <cstdint>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/types.hpp"

namespace brainshift::contact {

// With z re-estimated for every set, some data have no set that repeats itself exactly: one slave on the edge of
// contact flips for ever, by less than a micrometre (measured on the default head). Hence a tolerance, a
// thousandth of the gap.
inline constexpr double kContactTolerance_mm = 1e-3;
// The best set of an exhausted search is an answer when it is violated by no more: a twentieth of the gap, less than
// anything measures. What it is violated by is said.
inline constexpr double kHolds_mm = 0.05;
// Sets of a cycle without a better one after which a search whose best set holds is exhausted.
inline constexpr int kPatience = 4;

class SetSearch {
 public:
  enum class Step { kContinue, kCycling, kSolved, kExhausted };

  SetSearch(int slaves, int max_iterations, double tolerance_mm = kContactTolerance_mm);

  // Starts from the last solved set (empty at first).
  void begin();
  const contact::ActiveSet& current() const { return current_; }
  const contact::ActiveSet& best() const { return best_; }
  int iteration() const { return iteration_; }
  bool cycled() const { return cycled_; }
  // By the best set of a search that was not solved.
  double best_violation_mm() const { return best_violation_mm_; }
  // What the answer is violated by: less than the tolerance when solved, of the best set otherwise.
  double violation_mm() const { return solved_ ? tolerance_mm_ : best_violation_mm_; }

  // forces: one per slave, N, 0 for open ones; penetration: one per slave, mm.
  // compliance_diagonal turns a pulling force into a length, so that violations compare.
  Step next(const VecX& forces, const VecX& penetration, const VecX& compliance_diagonal);

  // The set that forces and penetration call for becomes the current one; true when it is another.
  bool follow(const VecX& forces, const VecX& penetration);

  // Of what forces and penetration call for, only the slave of least index that is violated by more than the tolerance
  // changes (the pivoting of Murty 1974, which cannot cycle for fixed loads): for callers that have no mean of loads.
  void pivot(const VecX& forces, const VecX& penetration, const VecX& compliance_diagonal);

  // Begin the next search from the best set / from the empty one.
  void adopt_best() { current_ = best_; }
  void forget();

 private:
  bool seen_before();
  double violation(std::size_t slave, const VecX& forces, const VecX& penetration,
                   const VecX& compliance_diagonal) const;

  contact::ActiveSet current_, best_;
  std::vector<std::uint64_t> visited_;
  double best_violation_mm_ = 0.0;
  int iteration_ = 0;
  int max_iterations_;
  int without_gain_ = 0;
  double tolerance_mm_;
  bool cycled_ = false;
  bool solved_ = false;
};

}  // namespace brainshift::contact
