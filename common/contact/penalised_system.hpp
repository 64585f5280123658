// SPDX-License-Identifier: GPL-3.0-or-later
// PenalisedSystem: K_p u = f for a set A of active slaves that changes during an inversion,
//
//   K_p = K + beta N_A N_A^T,     b_p = b + beta N_A 0p_A        (paper eq. 16, penalty.hpp)
//
// Three ways to apply K_p^-1; they differ in cost, not in the answer:
//   RefactorisedSystem  a new Cholesky factor for every set (the paper's)
//   WoodburySystem      low-rank correction of the factor of K
//   IterativeSystem     conjugate gradients with an incomplete factor of K_p
// Loads f, b and displacements u: 3 x n, RAS axes, N and mm. Keeps a reference to the forward
// model and may use its factor: one system per thread.
#pragma once

#include "common/contact/forward_model.hpp"
#include "common/core/error.hpp"
#include "common/fem/stiffness_factor.hpp"

namespace brainshift::contact {

class PenalisedSystem {
 public:
  // Starts with the empty set.
  explicit PenalisedSystem(const ForwardModel& forward);
  PenalisedSystem(const PenalisedSystem&) = delete;
  PenalisedSystem& operator=(const PenalisedSystem&) = delete;
  virtual ~PenalisedSystem() = default;

  const ForwardModel& forward() const { return forward_; }
  const ActiveSet& active() const { return active_; }
  // How often activate() changed the set to another one that is not empty.
  int changes() const { return changes_; }

  // Makes `active` the set of the solves that follow. Does nothing when it is the set already.
  // After an error the system must not be used. Errors as SparseCholesky::refactorise.
  Status activate(const ActiveSet& active);

  // u = K_p^-1 f. An iterative solver takes u as its first guess if u is 3 x n on entry; direct
  // solvers ignore it. kNotConverged from an iterative solver.
  virtual Status solve(const Points& f, Points& u) const = 0;
  // u = K_p^-1 b_p
  virtual Status solve_with_gaps(const Points& b, Points& u) const;

  // One contact iteration (paper section 2.4), given u = K_p^-1 b_p. The slaves that penetrate
  // become the active set. If that changes the set, u is solved anew and the result is true.
  Result<bool> follow_contact(const Points& b, Points& u);

 protected:
  // Prepares solves for active(), which has just changed.
  virtual Status refresh() = 0;

 private:
  const ForwardModel& forward_;
  ActiveSet active_;
  int changes_ = 0;
};

// RefactorisedSystem: a new Cholesky factor of K_p for every active set, as in the paper.
// Ordering and symbolic analysis are those of K.
class RefactorisedSystem final : public PenalisedSystem {
 public:
  explicit RefactorisedSystem(const ForwardModel& forward);
  // Errors as fem::checked_solve.
  Status solve(const Points& f, Points& u) const override;

 private:
  Status refresh() override;
  linalg::SymmetricMatrix matrix_;  // K_p, lower; empty while no slave is active
  double norm_ = 0.0;
  fem::StiffnessFactor penalised_;
};

}  // namespace brainshift::contact
