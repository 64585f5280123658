// SPDX-License-Identifier: GPL-3.0-or-later
// IterativeSystem: K_p u = f by preconditioned conjugate gradients, the paper's outlook. No
// factor of K_p is ever formed.
//
// Preconditioner: incomplete Cholesky of K_p with the pattern of K, shifted until it exists (Lin
// & More 1999, SIAM J. Sci. Comput. 21:24; Eigen::IncompleteCholesky), renewed when the set
// changes.
//
// Stop rule: |f - K_p u| <= tolerance |f - K_p u0|. u0 is sum_A N (N . f) / beta, which is what
// the contact springs take up, or 0, whichever has the smaller residual. The rule does not use
// |f|: with stiff springs (beta >> K) the spring forces in f are far larger than all others. With
// them in the scale the field was wrong by more than 0.1 % from beta = 1e6 N/mm on, and by 74 %
// at 1e9 (docs/stability.md).
#pragma once

#include <Eigen/IterativeLinearSolvers>
#include <memory>

#include "common/contact/penalised_system.hpp"

namespace brainshift::contact {

struct IterativeOptions {
  // Relative residual, as above. The displacement of the default head then differs by less than a
  // micrometre from that of a direct solve.
  double tolerance = 1e-8;
  // A solve of the default head takes a few hundred.
  int max_iterations = 5000;
};

class IterativeSystem final : public PenalisedSystem {
 public:
  // kSingularMatrix when K has no incomplete factor.
  static Result<std::unique_ptr<IterativeSystem>> build(const ForwardModel& forward,
                                                        const IterativeOptions& options = {});

  // kNotConverged names the number of iterations and the residual, computed anew from the answer.
  Status solve(const Points& f, Points& u) const override;
  // Conjugate-gradient iterations of all solves so far.
  int iterations() const { return iterations_; }

 private:
  IterativeSystem(const ForwardModel& forward, const IterativeOptions& options);
  Status refresh() override;
  void lift(const VecX& rhs, VecX& residual, VecX& q) const;

  // Natural ordering: on the default head it takes 260 iterations per solve against 317 with a
  // fill-reducing one, and a third of the time.
  using Preconditioner =
      Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<long>>;
  linalg::SymmetricMatrix matrix_;  // K_p, lower
  IterativeOptions options_;
  mutable Eigen::ConjugateGradient<linalg::SymmetricMatrix, Eigen::Lower, Preconditioner> solver_;
  mutable int iterations_ = 0;
};

}  // namespace brainshift::contact
