// SPDX-License-Identifier: GPL-3.0-or-later
// SetSearch: finds which slaves are active, by a primal-dual active set method (Hintermueller,
// Ito, Kunisch 2002).
//
// next() examines the solution for the current set. Its violation is the largest one of any
// slave: of an active slave that pulls (force f < 0), |f| times its compliance; of an open slave
// that penetrates (P > 0), P. Both are in mm.
//
//   kSolved     the violation is at most the tolerance
//   kContinue   active slaves that pull left the set, open slaves that penetrate joined it
//   kCycling    a set has been seen before. The loads depend on the set, so the sets of a cycle
//               can call for one another for ever. The set did not change: the caller chooses the
//               next one, by follow() with forces from a mean of the loads, or by pivot()
//   kExhausted  max_iterations is reached, or the search cycles, best() holds (kHolds_mm) and the
//               last kPatience sets were not better
//
// best() is the set with the least violation. Nothing is allocated after construction.
#pragma once

#include <cstdint>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/types.hpp"

namespace brainshift::contact {

// The prior modes are estimated anew for every set. For some data no set then repeats exactly:
// one slave at the edge of contact flips for ever, by less than a micrometre (measured on the
// default head). Hence a tolerance, a thousandth of the gap.
inline constexpr double kContactTolerance_mm = 1e-3;
// The best set of an exhausted search is accepted as an answer when its violation is at most
// this: a twentieth of the gap, less than any instrument resolves. The estimate's reason reports
// the violation.
inline constexpr double kHolds_mm = 0.05;
// Sets of a cycle without improvement after which a search whose best set holds is exhausted.
inline constexpr int kPatience = 4;

class SetSearch {
 public:
  enum class Step { kContinue, kCycling, kSolved, kExhausted };

  SetSearch(int slaves, int max_iterations, double tolerance_mm = kContactTolerance_mm);

  // Starts a search from the current set: the last solved one, or the one that adopt_best() or
  // forget() chose. Empty at first.
  void begin();
  const ActiveSet& current() const { return current_; }
  const ActiveSet& best() const { return best_; }
  int iteration() const { return iteration_; }
  bool cycled() const { return cycled_; }
  // Violation of best() in a search that was not solved.
  double best_violation_mm() const { return best_violation_mm_; }
  // Bound on the violation of the answer: the tolerance when solved, otherwise that of best().
  double violation_mm() const { return solved_ ? tolerance_mm_ : best_violation_mm_; }

  // forces: one per slave, N, 0 for open ones; penetration: one per slave, mm.
  // compliance_diagonal turns a pulling force into a length, so that violations compare.
  Step next(const VecX& forces, const VecX& penetration, const VecX& compliance_diagonal);

  // Makes the set that forces and penetration call for the current one. True when it is another.
  bool follow(const VecX& forces, const VecX& penetration);

  // Changes only one slave: of those that are violated by more than the tolerance, the one of
  // least index (Murty 1974; this cannot cycle for fixed loads). For callers that have no mean of
  // loads.
  void pivot(const VecX& forces, const VecX& penetration, const VecX& compliance_diagonal);

  // The next search begins from the best set / from the empty one.
  void adopt_best() { current_ = best_; }
  void forget();

 private:
  bool seen_before();
  double violation(std::size_t slave, const VecX& forces, const VecX& penetration,
                   const VecX& compliance_diagonal) const;

  ActiveSet current_, best_;
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
