// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/gradient.hpp"

namespace brainshift::inversion {

Status negative_gradient(contact::PenalisedSystem& system, const Misfit& misfit, const Points& e,
                         const Points& w, Points& lambda, Points& gradient) {
  if (auto status = system.solve(2.0 * misfit.adjoint(e), lambda); !status) return status;
  gradient = lambda - 2.0 * w;
  return {};
}

}  // namespace brainshift::inversion
