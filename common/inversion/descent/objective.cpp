// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/objective.hpp"

#include <cmath>

#include "common/inversion/contract/data_check.hpp"

namespace brainshift::inversion {

Misfit::Misfit(const SparseData& data, const fem::SamplingMatrix& sampling)
    : data_(data), sampling_(sampling), weights_(data.sd_mm.array().square().inverse()) {}

Result<Misfit> Misfit::build(const PreparedModel& model, const SparseData& data) {
  auto sampling = fem::sampling_matrix(model.locator(), model.model().mesh.num_nodes(),
                                       data.positions, kOutsideTolerance_mm);
  if (!sampling) return tl::unexpected(sampling.error());
  return Misfit(data, *sampling);
}

Points Misfit::sample(const Points& u) const { return (sampling_ * u.transpose()).transpose(); }

Points Misfit::residual(const Points& u) const { return data_.displacements - sample(u); }

Points Misfit::adjoint(const Points& r) const {
  return (sampling_.transpose() * (r * weights_.asDiagonal()).transpose()).transpose();
}

double Misfit::inner(const Points& r, const Points& s) const {
  return (r.cwiseProduct(s) * weights_.asDiagonal()).sum();
}

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
