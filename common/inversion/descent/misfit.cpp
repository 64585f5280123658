// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/misfit.hpp"

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

}  // namespace brainshift::inversion
