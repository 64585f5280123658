// SPDX-License-Identifier: GPL-3.0-or-later
// SetSearch: which slaves are active, found by a primal-dual active set (Hintermueller, Ito, Kunisch 2002).
//
// next() looks at the solution for the current set A: active slaves that pull (f < 0) leave, open slaves that
// penetrate (P > 0) join. Nothing violated by more than the tolerance: solved. A set seen before is a cycle: from then on only the violating slave
// of least index changes (the pivoting of Murty 1974, which cannot cycle for a fixed right-hand side). The set of
// least violation is kept as the best. Does not allocate after construction.
#pragma once

#include <cstdint>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/types.hpp"

namespace brainshift::inversion {

// With z re-estimated for every set, some data have no set that repeats itself exactly: one slave on the edge of
// contact flips for ever, by less than a micrometre (measured on the default head). Hence a tolerance, a
// thousandth of the gap.
inline constexpr double kContactTolerance_mm = 1e-3;

class SetSearch {
 public:
  enum class Step { kContinue, kSolved, kExhausted };

  SetSearch(int slaves, int max_iterations, double tolerance_mm = kContactTolerance_mm);

  // Starts from the last solved set (empty at first).
  void begin();
  const contact::ActiveSet& current() const { return current_; }
  const contact::ActiveSet& best() const { return best_; }
  int iteration() const { return iteration_; }
  bool cycled() const { return cycled_; }

  // forces: one per slave, N, 0 for open ones; penetration: one per slave, mm.
  // compliance_diagonal turns a pulling force into a length, so that violations compare.
  Step next(const VecX& forces, const VecX& penetration, const VecX& compliance_diagonal);

  // Begin the next search from the best set / from the empty one.
  void adopt_best() { current_ = best_; }
  void forget();

 private:
  bool seen_before();

  contact::ActiveSet current_, best_;
  std::vector<std::uint64_t> visited_;
  double best_violation_mm_ = 0.0;
  int iteration_ = 0;
  int max_iterations_;
  double tolerance_mm_;
  bool cycled_ = false;
};

}  // namespace brainshift::inversion
