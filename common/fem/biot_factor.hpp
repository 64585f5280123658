// SPDX-License-Identifier: GPL-3.0-or-later
// BiotFactor: displacement after one backward-Euler step from rest, with the pressure eliminated:
//
//   u = K_b^-1 f,   K_b = K + G (dt H + M + P)^-1 G^T      symmetric positive definite
//
// with the blocks of biot_matrix.hpp. So whatever works with a factor of K (contact stiffness,
// adjoints, covariances) works with this one too. K_b is dense and never formed: a solve is one
// with the factor of the whole matrix.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/fem/biot_matrix.hpp"
#include "common/linalg/symmetric_indefinite.hpp"

namespace brainshift::fem {

class BiotFactor {
 public:
  // Errors as SymmetricIndefinite::factorise.
  static Result<BiotFactor> factorise(BiotMatrix matrix);

  // Puts another stiffness of the same pattern (K_p) in the place of K. The pressure blocks stay.
  Status refactorise(const linalg::SymmetricMatrix& stiffness);
  BiotFactor clone_analysis() const;

  // A solve that fails its checks (SymmetricIndefinite::solve) returns NaN everywhere.
  void solve(const VecX& b, VecX& x) const;
  void solve_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) const;

  int size() const { return matrix_.displacement_unknowns; }
  double rcond() const { return factor_.rcond(); }
  std::uint64_t nonzeros() const { return factor_.nonzeros(); }
  std::uint64_t bytes() const;
  double analyse_seconds() const { return factor_.analyse_seconds(); }
  double factor_seconds() const { return factor_.factor_seconds(); }

 private:
  BiotFactor(BiotMatrix matrix, linalg::SymmetricIndefinite factor);
  BiotMatrix matrix_;
  linalg::SymmetricIndefinite factor_;
};

}  // namespace brainshift::fem
