// SPDX-License-Identifier: GPL-3.0-or-later
// PenalisedSystem: K_p u = f for a set A of active slaves that changes during an inversion,
//
//   K_p = K + beta N_A N_A^T,     b_p = b + beta N_A 0p_A                     (paper eq. 16, contact/penalty.hpp)
//
// Three ways to apply K_p^-1; they differ in cost, not in the answer:
//   RefactorisedSystem  a new Cholesky factor for every set (the paper's)
//   WoodburySystem      low-rank correction of the factor of K
//   IterativeSystem     conjugate gradients with an incomplete factor of K_p
// Loads f, b and displacements u: 3 x n, RAS axes, N and mm. Keeps a reference to the forward model, whose factor
// it may use: one system per thread.
#pragma once

#include "common/contact/forward_model.hpp"
#include "common/core/error.hpp"

namespace brainshift::contact {

class PenalisedSystem {
 public:
  // No slave is active.
  explicit PenalisedSystem(const contact::ForwardModel& forward);
  PenalisedSystem(const PenalisedSystem&) = delete;
  PenalisedSystem& operator=(const PenalisedSystem&) = delete;
  virtual ~PenalisedSystem() = default;

  const contact::ForwardModel& forward() const { return forward_; }
  const contact::ActiveSet& active() const { return active_; }
  // Sets other than the one before, the empty set not counted: contact iterations.
  int changes() const { return changes_; }

  // Makes `active` the set of the solves that follow; nothing happens when it is already. After an error the
  // system must not be used. Errors as SparseCholesky::refactorise.
  Status activate(const contact::ActiveSet& active);

  // u = K_p^-1 f. On entry u is the first guess of an iterative solver when it is 3 x n; else, and for
  // direct ones, it is not looked at. kNotConverged from an iterative solver.
  virtual Status solve(const Points& f, Points& u) const = 0;
  // u = K_p^-1 b_p
  Status solve_with_gaps(const Points& b, Points& u) const;

  // One contact iteration (paper section 2.4), u = K_p^-1 b_p given: slaves that penetrate become the active
  // set; if that changes it, u is solved again. True when it did.
  Result<bool> follow_contact(const Points& b, Points& u);

 protected:
  // Prepares solves for active(), which has just changed.
  virtual Status refresh() = 0;

 private:
  const contact::ForwardModel& forward_;
  contact::ActiveSet active_;
  int changes_ = 0;
};

}  // namespace brainshift::contact
