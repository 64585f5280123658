// SPDX-License-Identifier: GPL-3.0-or-later
// StiffnessFactor: solves K u = f for the displacement, with or without pressure in K.
//
//   SparseCholesky   drained elasticity
//   BiotFactor       one step of consolidation, pressure eliminated
//   DistributedCholesky  drained elasticity, by several processes that prepare a model together
//
// All are symmetric positive definite in u and can be refactorised with a stiffness of the same
// pattern (K_p).
#pragma once

#include <utility>
#include <variant>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/fem/biot_matrix.hpp"
#include "common/fem/dof_map.hpp"
#include "common/linalg/checked_solve.hpp"
#include "common/linalg/cholesky.hpp"
#include "common/linalg/distributed_cholesky.hpp"
#include "common/linalg/symmetric_indefinite.hpp"

namespace brainshift::fem {

// BiotFactor: displacement after one backward-Euler step from rest, with the pressure eliminated:
//
//   u = K_b^-1 f,   K_b = K + G (dt H + M + P)^-1 G^T      symmetric positive definite
//
// with the blocks of biot_matrix.hpp. So whatever works with a factor of K (contact stiffness,
// adjoints, covariances) works with this one too. K_b is dense and never formed: a solve is one
// with the factor of the whole matrix.
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

class StiffnessFactor {
 public:
  // Scratch memory for one thread that solves with a factor shared by several threads.
  using Workspace = linalg::SparseCholesky::Workspace;

  explicit StiffnessFactor(linalg::SparseCholesky factor) : factor_(std::move(factor)) {}
  explicit StiffnessFactor(BiotFactor factor) : factor_(std::move(factor)) {}
  // Solves when all processes solve; cannot be refactorised.
  explicit StiffnessFactor(linalg::DistributedCholesky factor) : factor_(std::move(factor)) {}

  // The factor of drained elasticity in this process alone, else nullptr.
  const linalg::SparseCholesky* drained() const {
    return std::get_if<linalg::SparseCholesky>(&factor_);
  }
  const linalg::DistributedCholesky* distributed() const {
    return std::get_if<linalg::DistributedCholesky>(&factor_);
  }

  // As SparseCholesky. With pressure, a solve that fails its checks is NaN everywhere.
  Status refactorise(const linalg::SymmetricMatrix& stiffness) {
    if (auto* cholesky = std::get_if<linalg::SparseCholesky>(&factor_)) {
      return cholesky->refactorise(stiffness);
    }
    return std::get<BiotFactor>(factor_).refactorise(stiffness);
  }
  StiffnessFactor clone_analysis() const {
    if (const auto* cholesky = drained()) return StiffnessFactor(cholesky->clone_analysis());
    return StiffnessFactor(std::get<BiotFactor>(factor_).clone_analysis());
  }
  void solve(const VecX& b, VecX& x) const {
    std::visit([&](const auto& f) { f.solve(b, x); }, factor_);
  }
  VecX solve(const VecX& b) const {
    VecX x;
    solve(b, x);
    return x;
  }
  void solve_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& x, Workspace& workspace) const {
    if (const auto* cholesky = std::get_if<linalg::SparseCholesky>(&factor_)) {
      cholesky->solve_rows(b, x, workspace);
    } else if (const auto* parts = distributed()) {
      parts->solve_rows(b, x);
    } else {
      std::get<BiotFactor>(factor_).solve_rows(b, x);
    }
  }

  int size() const {
    return std::visit([](const auto& f) { return f.size(); }, factor_);
  }
  double rcond() const {
    return std::visit([](const auto& f) { return f.rcond(); }, factor_);
  }
  std::uint64_t nonzeros() const {
    return std::visit([](const auto& f) { return f.nonzeros(); }, factor_);
  }
  std::uint64_t bytes() const {
    return std::visit([](const auto& f) { return f.bytes(); }, factor_);
  }
  double analyse_seconds() const {
    return std::visit([](const auto& f) { return f.analyse_seconds(); }, factor_);
  }
  double factor_seconds() const {
    return std::visit([](const auto& f) { return f.factor_seconds(); }, factor_);
  }

 private:
  std::variant<linalg::SparseCholesky, BiotFactor, linalg::DistributedCholesky> factor_;
};

// x = K^-1 b, as linalg::checked_solve. With pressure the matrix of the factor is never formed.
// Its factor has checked itself (symmetric_indefinite.hpp) and returns NaN where it rejected the
// solve. Then the error is kNotFinite; otherwise the backward error is given as 0.
Result<linalg::SolveQuality> checked_solve(const linalg::SymmetricMatrix& lower, double norm,
                                           const StiffnessFactor& factor, const VecX& b, VecX& x);
// The same for the rows of B, after factor.solve_rows(B, X, workspace).
Result<linalg::SolveQuality> check_rows(const linalg::SymmetricMatrix& lower, double norm,
                                        const StiffnessFactor& factor, const Eigen::MatrixXd& b,
                                        Eigen::MatrixXd& x, StiffnessFactor::Workspace& workspace);

// BlockSolver: K^-1 applied to several nodal loads at once. One per thread; the threads
// share the factor.
class BlockSolver {
 public:
  // Keeps references to all three. stiffness: the matrix of the factor.
  BlockSolver(const linalg::SymmetricMatrix& stiffness, const StiffnessFactor& factor,
              const DofMap& dofs);

  // U = T K^-1 T^T F, transposed: a field per row, k x 3n, node-major. F in N, U in mm; both may be
  // the same matrix. Errors as check_rows.
  Status solve(const Eigen::MatrixXd& loads, Eigen::MatrixXd& displacements);

 private:
  const linalg::SymmetricMatrix& stiffness_;
  double norm_;
  const StiffnessFactor& factor_;
  const DofMap& dofs_;
  StiffnessFactor::Workspace workspace_;
  Eigen::MatrixXd rhs_, unknowns_;
};

}  // namespace brainshift::fem
