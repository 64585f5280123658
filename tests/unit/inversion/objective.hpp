// SPDX-License-Identifier: GPL-3.0-or-later
// Omega (paper eq. 4) and its gradient for a given active set, from the product's parts: what steps
// 2 to 5 of descents.hpp compute, for comparison with finite differences.
#pragma once

#include "common/contact/penalised_system.hpp"
#include "common/inversion/descent/objective.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::inversion {

struct Objective {
  double value = 0.0;
  Points gradient;  // 2 w - lambda with respect to b, 3 x n, RAS axes
};

// w = W_b b: 3 x n.
inline Result<Objective> evaluate_objective(const PreparedModel& model, const SparseData& data,
                                            const Points& w, const contact::ActiveSet& active) {
  const auto misfit = Misfit::build(model, data);
  if (!misfit) return tl::unexpected(misfit.error());
  contact::RefactorisedSystem system(model.forward());
  if (auto status = system.activate(active); !status) return tl::unexpected(status.error());
  const Points b = model.prior().apply(w);
  Points u, lambda, downhill;
  if (auto s = system.solve_with_gaps(b, u); !s) return tl::unexpected(s.error());
  const Points e = misfit->residual(u);
  if (auto s = negative_gradient(system, *misfit, e, w, lambda, downhill); !s) {
    return tl::unexpected(s.error());
  }
  return Objective{misfit->inner(e, e) + inner(b, w), -downhill};
}

}  // namespace brainshift::inversion
