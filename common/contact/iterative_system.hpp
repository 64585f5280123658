// SPDX-License-Identifier: GPL-3.0-or-later
// K_p u = f by preconditioned conjugate gradients, the paper's outlook: no factor of K_p is ever formed.
//
// Preconditioner: incomplete Cholesky of K_p with the pattern of K, shifted until it exists (Lin & More 1999, SIAM J.
// Sci. Comput. 21:24; Eigen::IncompleteCholesky), renewed when the set changes. Stops when
// |f - K_p u| <= tolerance |f - K_p u0|, u0 = sum_A N (N . f) / beta or 0, whichever leaves less: what the springs of contact take up is known, and
// a stiff one (beta >> K) would drown every other force in |f|. With it left in, the field was wrong by
// more than 0.1 % from beta = 1e6 N/mm on and by 74 % at 1e9 (docs/stability.md).
#pragma once

#include <Eigen/IterativeLinearSolvers>
#include <memory>

#include "common/contact/penalised_system.hpp"

namespace brainshift::contact {

struct IterativeOptions {
  // Relative residual, as above. The displacement of the default head then differs by less than a micrometre from that of a
  // direct solve.
  double tolerance = 1e-8;
  // A solve of the default head takes a few hundred.
  int max_iterations = 5000;
};

class IterativeSystem final : public PenalisedSystem {
 public:
  // kSingularMatrix when K has no incomplete factor.
  static Result<std::unique_ptr<IterativeSystem>> build(const contact::ForwardModel& forward,
                                                        const IterativeOptions& options = {});

  // kNotConverged names the iterations done and the residual left, which is computed anew from the answer.
  Status solve(const Points& f, Points& u) const override;
  // Of all solves so far.
  int iterations() const { return iterations_; }

 private:
  IterativeSystem(const contact::ForwardModel& forward, const IterativeOptions& options);
  Status refresh() override;
  void lift(const VecX& rhs, VecX& residual, VecX& q) const;

  // The unknowns' own order: on the default head 260 iterations per solve against 317 with a fill-reducing one, and a
  // third of the time.
  using Preconditioner =
      Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<long>>;
  linalg::SymmetricMatrix matrix_;  // K_p, lower
  IterativeOptions options_;
  mutable Eigen::ConjugateGradient<linalg::SymmetricMatrix, Eigen::Lower, Preconditioner> solver_;
  mutable int iterations_ = 0;
};

}  // namespace brainshift::contact
