// SPDX-License-Identifier: GPL-3.0-or-later
// The answer of another method: element matrices as B^T D B, a dense Cholesky factor, all in long
// double (64-bit mantissa, unit roundoff 5e-20).
//
//   K_p = K + beta sum_A N N^T,   b_p = b + beta sum_A 0p N,   P = 0p - N . u
//
// A dense factor takes cubes of the unknowns: some hundred of them take a tenth of a second.
#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/dof_map.hpp"
#include "common/fem/elasticity.hpp"

namespace brainshift::stability {

using Real = long double;
using MatrixR = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using VectorR = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Vec3R = Eigen::Matrix<Real, 3, 1>;
using Mat3R = Eigen::Matrix<Real, 3, 3>;
using PointsR = Eigen::Matrix<Real, 3, Eigen::Dynamic>;

// May be copied before compute(): Eigen leaves the success of a factor not computed yet undefined.
class CholeskyFactor : public Eigen::LLT<MatrixR> {
 public:
  CholeskyFactor() : Eigen::LLT<MatrixR>(MatrixR::Identity(1, 1)) {}
  explicit CholeskyFactor(const MatrixR& matrix) : Eigen::LLT<MatrixR>(matrix) {}
};

// u_node = frame * q_node; index: of the unknown, or -1 where a component is zero.
struct Unknowns {
  std::vector<Mat3R> frames;
  std::vector<std::array<int, 3>> index;
  int count = 0;

  int num_nodes() const { return static_cast<int>(frames.size()); }
  // T^T f and T q; nodal vectors have 3n entries, node by node.
  VectorR restrict_to(const Eigen::Ref<const VectorR>& nodal) const;
  VectorR expand(const Eigen::Ref<const VectorR>& unknowns) const;
};
// Of a body whose supports the sweep itself chose.
Unknowns unknowns_of(const fem::DofMap& dofs);

// lambda = 2 G nu / (1 - 2 nu); G in Pa.
fem::Elasticity reference_elasticity(double shear_pa, double poisson_ratio);
// materials: one per tetrahedron, or one for all.
MatrixR reference_stiffness(const TetMesh& mesh, const std::vector<fem::Elasticity>& materials,
                            const Unknowns& unknowns);
// The same matrix in double as the product takes it, for problems that it cannot assemble itself
// (materials per element).
linalg::SymmetricMatrix lower_triangle(const MatrixR& full);

struct ReferencePair {
  NodeIndex slave = -1;
  Vec3R normal = Vec3R::Zero();     // N, from skull into brain
  Real initial_penetration_mm = 0;  // 0p, negative when open
};

class Reference {
 public:
  Reference(MatrixR stiffness, Unknowns unknowns, std::vector<ReferencePair> pairs = {},
            Real beta = 0);

  // K_p of a set; false when it is not positive definite.
  bool activate(const contact::ActiveSet& active);
  const contact::ActiveSet& active() const { return active_; }
  // K_p^-1 of the set.
  MatrixR solve(const MatrixR& rhs) const;
  // K^-1, whatever the set.
  MatrixR solve_free(const MatrixR& rhs) const { return free_.solve(rhs); }
  // u = K_p^-1 b_p, 3n; load: 3 x n.
  VectorR displacement(const Points& load) const;
  // P of every slave; u: 3n.
  VectorR penetration(const VectorR& u) const;
  // Contact by a semi-smooth Newton method; false when it cycles.
  bool solve_contact(const Points& load, VectorR& u);
  // Ratio of the extreme eigenvalues of K_p, by 40 power iterations each.
  double condition() const;

  const Unknowns& unknowns() const { return unknowns_; }
  const std::vector<ReferencePair>& pairs() const { return pairs_; }
  int num_slaves() const { return static_cast<int>(pairs_.size()); }
  Real beta() const { return beta_; }

 private:
  bool any_active() const;
  // beta sum_A 0p N added to a nodal load.
  void add_gaps(VectorR& nodal) const;

  MatrixR stiffness_;
  Unknowns unknowns_;
  std::vector<ReferencePair> pairs_;
  Real beta_;
  contact::ActiveSet active_;
  CholeskyFactor free_, factor_;  // of K and, for a set that is not empty, of K_p
  MatrixR matrix_;                // K_p
};

// |u - v|_2 / |v|_2; v: 3n.
double relative_difference(const Points& u, const VectorR& v);
// Greatest distance at a node, mm; NaN when a value is not finite.
double greatest_difference(const Points& u, const VectorR& v);

}  // namespace brainshift::stability
