// SPDX-License-Identifier: GPL-3.0-or-later
// K_p refactorised for every new active set, as the paper does; ordering and symbolic analysis are those of K.
#pragma once

#include "common/fem/stiffness_factor.hpp"
#include "common/inversion/penalised_system.hpp"

namespace brainshift::inversion {

class RefactorisedSystem final : public PenalisedSystem {
 public:
  explicit RefactorisedSystem(const contact::ForwardModel& forward);
  Status solve(const Points& f, Points& u) const override;

 private:
  Status refresh() override;
  fem::StiffnessFactor penalised_;
};

}  // namespace brainshift::inversion
