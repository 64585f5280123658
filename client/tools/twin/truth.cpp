// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/truth.hpp"

#include <string>
#include <utility>

namespace brainshift::client {

Result<Truth> TruthSolver::solve(const Points& load) {
  Truth truth;
  Points u;
  if (Status ok = system_.solve_with_gaps(load, u); !ok) return tl::unexpected(ok.error());
  for (truth.iterations = 1; truth.iterations <= kMaxIterations; ++truth.iterations) {
    const auto changed = system_.follow_contact(load, u);
    if (!changed) return tl::unexpected(changed.error());
    if (*changed) continue;
    truth.active = contact::count(system_.active());
    const contact::PenaltyContact& contact = system_.forward().contact();
    if (contact.num_slaves() > 0) truth.max_penetration_mm = contact.penetration(u).maxCoeff();
    truth.displacement = std::move(u);
    return truth;
  }
  return fail(ErrorCode::kNotConverged, "the contact search of the truth did not settle after " +
                                            std::to_string(kMaxIterations) + " solves");
}

}  // namespace brainshift::client
