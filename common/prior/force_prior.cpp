// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/force_prior.hpp"

#include <utility>

namespace brainshift::prior {

ForcePrior::ForcePrior(std::array<ForceKernel, kRemainders> kernels, LoadModes modes)
    : kernels_(std::move(kernels)), modes_(std::move(modes)) {}

void ForcePrior::apply(const Points& w, Points& f) const {
  f.setZero(3, w.cols());
  for (const ForceKernel& kernel : kernels_) kernel.add_to(w, f);
  if (num_modes() == 0) return;
  const Eigen::Map<const VecX> w_flat(w.data(), w.size());
  Eigen::Map<VecX> f_flat(f.data(), f.size());
  f_flat.noalias() += modes() * (modes().transpose() * w_flat);
}

Points ForcePrior::apply(const Points& w) const {
  Points f;
  apply(w, f);
  return f;
}

void ForcePrior::apply_remainders(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const {
  Eigen::MatrixXd one;
  f.setZero(w.rows(), w.cols());
  for (const ForceKernel& kernel : kernels_) {
    kernel.apply(w, one);
    f += one;
  }
}

std::uint64_t ForcePrior::bytes() const {
  std::uint64_t sum = static_cast<std::uint64_t>(modes().size()) * sizeof(double);
  for (const ForceKernel& kernel : kernels_) sum += kernel.bytes();
  return sum;
}

}  // namespace brainshift::prior
