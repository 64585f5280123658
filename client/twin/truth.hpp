// SPDX-License-Identifier: GPL-3.0-or-later
// TruthSolver: K u = b with penalty contact, for one load after the other of a surgery that goes on.
//
// The same penalty equations as contact::solve_with_contact (paper section 2.4): refactorise K_p for the active
// set, solve, take the slaves that penetrate as the next set, until it repeats. Here every load starts from the
// set and the factor of the one before; the few slaves in which a set differs from the factor's are a low-rank
// correction. So a load that changes little costs a few solves instead of a search from the empty set. A set
// that repeats is a solution of the penalty equations wherever the search began.
#pragma once

#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

struct Truth {
  Points displacement;  // 3 x n, mm
  int active = 0;       // slaves that carry a contact force
  double max_penetration_mm =
      0.0;             // over all slaves; negative: minus the least distance to the skull
  int iterations = 0;  // linear solves
};

class TruthSolver {
 public:
  // Keeps a reference to `forward`, which must outlive it.
  explicit TruthSolver(const contact::ForwardModel& forward);

  // load: 3 x n, N. kNotConverged when the set has not repeated after kMaxIterations solves; else as
  // fem::StiffnessFactor.
  Result<Truth> solve(const Points& load);

  static constexpr int kMaxIterations = 40;
  // Up to so many slaves are corrected for; beyond, a factorisation costs no more than the columns.
  static constexpr std::size_t kMaxCorrected = 64;

 private:
  void correct(const contact::ActiveSet& active, const std::vector<int>& changed, VecX& x) const;
  Result<Points> solve_with(const contact::ActiveSet& active, const Points& load);

  const contact::ForwardModel& forward_;
  fem::StiffnessFactor penalised_;
  contact::ActiveSet active_;
  contact::ActiveSet factored_;  // the set that penalised_ holds; empty: none yet
};

}  // namespace brainshift::client
