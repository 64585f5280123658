// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/objective.hpp"

#include <cmath>

namespace brainshift::inversion {

double inner(const Points& a, const Points& b) { return a.cwiseProduct(b).sum(); }

Status negative_gradient(contact::PenalisedSystem& system, const Misfit& misfit, const Points& e,
                         const Points& w, Points& lambda, Points& gradient) {
  if (auto status = system.solve(2.0 * misfit.adjoint(e), lambda); !status) return status;
  gradient = lambda - 2.0 * w;
  return {};
}

Result<double> exact_step(const Misfit& misfit, const Points& e, const Points& az, const Points& b,
                          const Points& s, const Points& dw) {
  const double curvature = misfit.inner(az, az) + inner(s, dw);
  if (!std::isfinite(curvature)) {
    return fail(ErrorCode::kNotFinite, "inversion: the curvature of the line search is not finite");
  }
  if (!(curvature > 0.0)) return 0.0;
  return (misfit.inner(e, az) - inner(b, dw)) / curvature;
}

}  // namespace brainshift::inversion
