// SPDX-License-Identifier: GPL-3.0-or-later
// RefactorisedSystem: a new Cholesky factor of K_p for every active set, as in the paper.
// Ordering and symbolic analysis are those of K.
#pragma once

#include "common/contact/penalised_system.hpp"
#include "common/fem/stiffness_factor.hpp"

namespace brainshift::contact {

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
