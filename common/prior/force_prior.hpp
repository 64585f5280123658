// SPDX-License-Identifier: GPL-3.0-or-later
// ForcePrior: prior on the forcing b, zero-mean Gaussian with covariance Sigma = W_b^-1 (paper
// eq. 4).
//
//   Sigma = Sigma_fine + Sigma_medium + Sigma_coarse + M M^T
//
// The first three are smooth residual fields of three correlation lengths (force_kernel.hpp): fine
// is the paper's, compact; medium and coarse have a basis. M: load modes, one nodal force field per
// column, each times its standard deviation (load_modes.hpp).
// Assumption: forces in different directions and of different parts are independent.
#pragma once

#include <array>
#include <cstdint>

#include "common/core/types.hpp"
#include "common/prior/force_kernel.hpp"
#include "common/prior/load_modes.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::prior {

class ForcePrior {
 public:
  // kernels: of the residual fields, in the order of PriorPart.
  ForcePrior(std::array<ForceKernel, kRemainders> kernels, LoadModes modes);

  // f = Sigma w; w: 3 x n (mm), f: 3 x n (N).
  void apply(const Points& w, Points& f) const;
  Points apply(const Points& w) const;

  // f = (Sigma_fine + Sigma_medium + Sigma_coarse) w for several nodal fields at once, one per row:
  // k x 3n, node-major. Thread-safe.
  void apply_remainders(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const;

  // field: 0 fine, 1 medium, 2 coarse.
  const ForceKernel& kernel(int field) const { return kernels_[static_cast<std::size_t>(field)]; }
  int num_modes() const { return modes_.size(); }
  const Eigen::MatrixXd& modes() const { return modes_.columns; }
  const PerPart<int>& columns_of_part() const { return modes_.of_part; }
  std::uint64_t bytes() const;

 private:
  std::array<ForceKernel, kRemainders> kernels_;
  LoadModes modes_;
};

}  // namespace brainshift::prior
