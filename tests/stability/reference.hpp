// SPDX-License-Identifier: GPL-3.0-or-later
// The answer of another method: assembled by B^T D B element by element, solved by a dense Cholesky factor, all in
// long double (64-bit mantissa, 5e-20); nothing is shared with the product but the mesh, the frames of the fixed
// nodes, the contact pairs and the kernel of the prior.
//
//   K_p = K + beta sum_A N N^T,   b_p = b + beta sum_A 0p N
//   posterior   u = s + C A^T (A C A^T + R)^-1 (d - A s),   C = K_p^-1 Sigma K_p^-1,   s = K_p^-1 beta sum_A 0p N
//
// Long double takes cubes of the unknowns: some hundred. For larger meshes the same in double with a sparse factor.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/mesh.hpp"
#include "common/values/sparse_data.hpp"
#include "common/fem/dof_map.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::stability {

using Real = long double;
using MatrixR = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using VectorR = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

// One material per tetrahedron, or one for all.
MatrixR reference_stiffness(const TetMesh& mesh, const std::vector<fem::Elasticity>& materials,
                            const fem::DofMap& dofs);
// The same matrix in double as the product takes it, for problems that it cannot assemble itself (materials per
// element).
linalg::SymmetricMatrix lower_triangle(const MatrixR& full);

// T^T f and T q in long double.
VectorR restrict_to(const fem::DofMap& dofs, const Eigen::Ref<const MatrixR>& nodal);
VectorR expand(const fem::DofMap& dofs, const VectorR& unknowns);

class Reference {
 public:
  // contact: may be null.
  Reference(MatrixR stiffness, const fem::DofMap& dofs, const contact::PenaltyContact* contact);

  // K_p of a set; false when it is not positive definite.
  bool activate(const contact::ActiveSet& active);
  VectorR solve(const VectorR& rhs) const { return factor_.solve(rhs); }
  MatrixR solve(const MatrixR& rhs) const { return factor_.solve(rhs); }
  // u = K_p^-1 b_p, 3n; load: 3 x n.
  VectorR displacement(const Points& load) const;
  // P of every slave.
  VectorR penetration(const VectorR& u) const;
  // Contact by the same semi-smooth Newton method; false when it cycles.
  bool solve_contact(const Points& load, VectorR& u);
  const contact::ActiveSet& active() const { return active_; }
  // Estimates of the extreme eigenvalues' ratio of K_p, 40 power iterations each.
  double condition() const;

 private:
  const MatrixR stiffness_;
  const fem::DofMap& dofs_;
  const contact::PenaltyContact* contact_;
  contact::ActiveSet active_;
  MatrixR matrix_;
  Eigen::LLT<MatrixR> factor_;
};

// Of one prepared toy patient.
struct PosteriorReference {
  VectorR displacement;  // 3n
  VectorR penetration;   // of every slave, mm
};
// The posterior mean for the active set and the prior's scales of an estimate; false when a factor fails.
bool reference_posterior(Reference& reference, const inversion::PreparedModel& model,
                         const SparseData& data, const Estimate& estimate,
                         PosteriorReference& result);

// |u - v|_2 / |v|_2
double relative_difference(const Points& u, const VectorR& v);
// Greatest distance at a node, mm.
double greatest_difference(const Points& u, const VectorR& v);

}  // namespace brainshift::stability
