// SPDX-License-Identifier: GPL-3.0-or-later
// ForcePrior: prior on the forcing b, zero-mean Gaussian with covariance Sigma = W_b^-1 (paper
// eq. 4).
//
//   Sigma = sigma_f^2 (V R V) (x) I_3  +  M M^T
//
// sigma_f: standard deviation of the *force density* (N/mm^3); V = diag(nodal volume, mm^3), so
// that the prior does not depend on the mesh. R_ij = rho(|x_i - x_j|) with Wendland's C2
// function, which is positive definite in three dimensions and exactly zero beyond its support:
//
//   rho(r) = (1 - r/S)^4 (4 r/S + 1) for r < S, else 0,     S = 4.2 L
//
// L: correlation length. rho falls like the paper's (1 + r/L) exp(-r/L), a little faster (the two
// differ by at most 0.2, near r = 2.4 L). Unlike a truncation of that function it keeps Sigma
// positive definite (Wendland 1995, Adv. Comput. Math. 4:389-396).
//
// M: load modes, one nodal force field per column, each times its standard deviation: gravity
// modes (what pose and drainage leave open), then swelling modes (load_modes.hpp).
// Assumption: forces in different directions and from different modes are independent.
#pragma once

#include <Eigen/SparseCore>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::prior {

class ForcePrior {
 public:
  // nodes: 3 x n; nodal_volumes: n; modes: M, 3n x k, node-major (x0 y0 z0 x1 ...).
  ForcePrior(const Points& nodes, const VecX& nodal_volumes, double correlation_length_mm,
             double force_density_sd, Eigen::MatrixXd modes);

  // f = Sigma w; w: 3 x n (mm), f: 3 x n (N).
  void apply(const Points& w, Points& f) const;
  Points apply(const Points& w) const;

  // The kernel part alone (without M M^T), for several nodal columns at once: 3n rows,
  // node-major. Thread-safe.
  void apply_kernel(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const;

  int num_modes() const { return static_cast<int>(modes_.cols()); }
  const Eigen::MatrixXd& modes() const { return modes_; }
  // sigma_f^2 V R V, n x n, both triangles.
  const Eigen::SparseMatrix<double, Eigen::RowMajor>& kernel() const { return kernel_; }
  std::uint64_t bytes() const;

 private:
  Eigen::SparseMatrix<double, Eigen::RowMajor> kernel_;
  Eigen::MatrixXd modes_;
};

// rho(r) above.
double wendland_c2(double r, double support);

inline constexpr double kSupportOverCorrelationLength = 4.2;

}  // namespace brainshift::prior
