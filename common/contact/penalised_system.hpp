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

#include <Eigen/Cholesky>

#include <vector>

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

// WoodburySystem: K_p^-1 as a low-rank correction of the factor of K (Woodbury 1950; Hager 1989,
// SIAM Review 31:221):
//
//   K_p^-1 f = K^-1 (f - N_A c),   (Phi_AA + I / beta) c = N_A^T K^-1 f
//   Phi = N^T K^-1 N               compliance of the slaves, mm/N
//
// This is K^-1 f - X_A (Phi_AA + I / beta)^-1 X_A^T f with X_A = K^-1 N_A. A column of X is
// computed when its slave is active for the first time, in blocks, and only its entries in Phi
// are kept, for the life of the system. X itself is not kept: a product with X_A would read as
// much memory as a second solve with the factor does, and X takes 3n numbers per slave that was
// ever active (0.4 MB each for the default head). The dense matrix Phi_AA + I / beta is
// factorised when the set changes.
//
// Initial penetrations 0p go into the small system instead of the load:
//
//   K_p^-1 b_p = K^-1 (b - N_A c),   (Phi_AA + I / beta) c = N_A^T K^-1 b - 0p_A
//
// -c is then the contact force itself. In b_p = b + beta N_A 0p_A it would be the difference of
// numbers of size beta, and nothing would be left of it from beta = 1e8 N/mm on.
//
// Checks: the backward error of every solve with K and of every block of columns
// (checked_solve.hpp). So K u + N_A c = f holds. u also solves the penalised equations when c =
// beta (N_A^T u - 0p_A), up to
//
//   eta = max_A |c - beta (N_A^T u - 0p_A)| / (beta max|u| + max|f|)
//
// with 0p = 0 for solve(). A solve with eta above kRefuseAbove is refined, u += K_p^-1 N_A r with
// r the difference above, and rejected if eta stays above it after kMaxRefinements.
class WoodburySystem final : public PenalisedSystem {
 public:
  explicit WoodburySystem(const ForwardModel& forward);
  // Errors as ForwardModel::solve; kSingularMatrix: eta above kRefuseAbove.
  Status solve(const Points& f, Points& u) const override;
  Status solve_with_gaps(const Points& b, Points& u) const override;
  // Columns of Phi computed so far.
  int columns() const;

 private:
  // f: 3 x n; gaps: 0p of the set. u = K_p^-1 (f + beta N_A gaps), checked and refined.
  Status solve_with(const Points& f, const VecX& gaps, Points& u) const;
  // The same, and c, by the formula above without the check of eta.
  Status apply(const Points& f, const VecX& gaps, Points& u, VecX& c) const;
  // c - beta (N_A^T u - gaps).
  VecX imbalance(const Points& u, const VecX& c, const VecX& gaps) const;
  Status refresh() override;
  Status solve_columns(const std::vector<int>& slaves);

  std::vector<int> set_;     // indices of the active slaves
  std::vector<char> known_;  // per slave: its column of Phi is computed
  Eigen::MatrixXd phi_;      // slaves x slaves; the other columns hold nothing
  Eigen::LLT<Eigen::MatrixXd> capacitance_;
  fem::StiffnessFactor::Workspace workspace_;  // of blocks of columns
};

}  // namespace brainshift::contact
