// SPDX-License-Identifier: GPL-3.0-or-later
// ForcePrior: prior on the forcing b, zero-mean Gaussian with covariance Sigma = W_b^-1 (paper
// eq. 4).
//
//   Sigma = Sigma_fine + Sigma_medium + Sigma_coarse + Sigma_far + M M^T
//
// The first are smooth residual fields of three correlation lengths (ForceKernel): fine is the
// paper's, compact; medium and coarse have a basis. Of these two Sigma_far is what lies far from
// where data may come from (ForceKernel::basis_about): no data say how strong it is. M: load modes,
// one nodal force field per column, each times its standard deviation (load_modes.hpp).
// Assumption: forces in different directions and of different parts are independent.
#pragma once

#include <Eigen/SparseCore>

#include <array>
#include <cstdint>
#include <vector>

#include "common/core/types.hpp"
#include "common/prior/load_modes.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::prior {

// ForceKernel: covariance of a smooth random force density, the same for each component, as nodal
// forces:
//
//   Sigma = sigma_f^2 (V R V) (x) I_3
//
// sigma_f: standard deviation of the *force density* (N/mm^3); V = diag(nodal volume, mm^3), so
// that the prior does not depend on the mesh; R: correlation matrix of the nodes. Two kinds:
//
//   compact   R_ij = rho(|x_i - x_j|), Wendland's C2 function, which is positive definite in three
//             dimensions and exactly zero beyond its support:
//               rho(r) = (1 - r/S)^4 (4 r/S + 1) for r < S, else 0,     S = 4.2 L
//             L: correlation length. rho falls like the paper's (1 + r/L) exp(-r/L), a little
//             faster (the two differ by at most 0.2, near r = 2.4 L). Unlike a truncation of that
//             function it keeps Sigma positive definite (Wendland 1995, Adv. Comput. Math.
//             4:389-396). Sparse: for lengths of a few elements.
//   basis     R = k_nc k_cc^-1 k_cn with k = (1 + r/L) exp(-r/L) between the nodes n and centres c
//             spread over them (a Nystrom approximation, Williams & Seeger 2001, NIPS 13): as many
//             as kCentresPerLength for each L^3 of the mesh. A compact kernel of 20 mm would be
//             nearly dense.
class ForceKernel {
 public:
  // nodes: 3 x n, mm; nodal_volumes: n, mm^3; L: correlation length, mm; sigma_f, N/mm^3.
  static ForceKernel compact(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                             double force_density_sd);
  static ForceKernel basis(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                           double force_density_sd);
  // The same covariance as basis() with its centres in another order, in two independent parts:
  // what the centres near the nodes `places` explain of it, and the rest given that.
  struct NearAndFar;
  static NearAndFar basis_about(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                                double force_density_sd, const std::vector<NodeIndex>& places,
                                double near_mm);
  // Of the sum of two independent fields, each with a basis.
  static ForceKernel sum_of(const ForceKernel& a, const ForceKernel& b);

  // f += Sigma w for one nodal field; w, f: 3 x n.
  void add_to(const Points& w, Points& f) const;
  // f = Sigma w for several fields at once, one per row: k x 3n, node-major (x0 y0 z0 x1 ...).
  // Thread-safe.
  void apply(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const;
  // w^T Sigma w of each field: the variance of the work that the random forces do on it. w: k x 3n
  // as above; -> k numbers, mm^2 N^2. Half the cost of apply(). Thread-safe.
  VecX variance_along(const Eigen::MatrixXd& w) const;
  std::uint64_t bytes() const;

  static constexpr double kSupportOverLength = 4.2;
  static constexpr double kCentresPerLength = 3.0;
  static constexpr int kFewestCentres = 48, kMaxCentres = 500;

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  // A component of a field in a column of its own.
  using Fields = Eigen::Map<const RowMajor>;
  static ForceKernel of_centres(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                                double force_density_sd, const Points& centres);
  // out = sigma_f^2 V R V in: n rows, both apart in memory.
  void multiply(const Fields& in, Eigen::Map<RowMajor> out) const;
  // basis_^T in, transposed: a row per component.
  Eigen::MatrixXd project(const Fields& in) const;

  Eigen::SparseMatrix<double, Eigen::RowMajor> compact_;  // sigma_f^2 V R V, or empty
  RowMajor basis_;  // sigma_f V k_nc L_cc^-T with L_cc L_cc^T = k_cc, or empty
};

struct ForceKernel::NearAndFar {
  ForceKernel near, far;
};

// A centre is near the data when it lies within this distance of a node of their region: about the
// lengths over which the fields' displacements reach.
inline constexpr double kNearMedium_mm = 30.0, kNearCoarse_mm = 40.0;

// rho(r) above.
double wendland_c2(double r, double support);

class ForcePrior {
 public:
  // kernels: of the residual fields, in the order of PriorPart.
  ForcePrior(std::array<ForceKernel, kRemainders> kernels, LoadModes modes);

  // f = Sigma w; w: 3 x n (mm), f: 3 x n (N).
  void apply(const Points& w, Points& f) const;
  Points apply(const Points& w) const;

  // field: 0 fine, 1 medium, 2 coarse, 3 far.
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
