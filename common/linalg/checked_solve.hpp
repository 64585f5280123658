// SPDX-License-Identifier: GPL-3.0-or-later
// x = K^-1 b with a check: the backward error of every solve is measured. A solve with a large
// error is refined, and rejected when the error stays large.
//
//   eta = |b - K x| / (|K| |x| + |b|)          maximum norms; Rigal and Gaches 1967, J. ACM 14:543
//
// eta is the smallest relative change of K and b for which x is exact. A Cholesky factor that
// fits its matrix leaves about 1e-16; with a factor of another matrix, a lost digit or an
// overflow eta is far larger. Refinement x += K^-1 (b - K x) in the same precision repairs a
// slightly wrong factor (Skeel 1980, Math. Comp. 35:817).
//
// Several right-hand sides at once are checked by one random combination of them, (B - K X) w
// with w_j = +-1. A wrong column is missed only if errors cancel to the last digits. The check
// costs one product with K.
#pragma once

#include "common/core/error.hpp"
#include "common/linalg/cholesky.hpp"
#include "common/linalg/symmetric_matrix.hpp"

namespace brainshift::linalg {

// Measured in `make stability` (penalty, contrast, slivers, loads): eta is at most 3e-16, and no
// solve was refined.
inline constexpr double kRefineAbove = 1e-14;
inline constexpr double kRefuseAbove = 1e-11;
inline constexpr int kMaxRefinements = 2;

struct SolveQuality {
  double backward_error = 0.0;
  int refinements = 0;
};

// eta above; NaN when x or b is not finite. norm: max_norm(lower). Returns K x in `product`.
double backward_error(const SymmetricMatrix& lower, double norm, const VecX& b, const VecX& x,
                      VecX& product);

// x = K^-1 b. kNotFinite: b or x is not finite; kSingularMatrix: eta stays above kRefuseAbove.
Result<SolveQuality> checked_solve(const SymmetricMatrix& lower, double norm,
                                   const SparseCholesky& factor, const VecX& b, VecX& x);

// The same for the rows of B, after factor.solve_rows(B, X, workspace). Refines all rows.
Result<SolveQuality> check_rows(const SymmetricMatrix& lower, double norm,
                                const SparseCholesky& factor, const Eigen::MatrixXd& b,
                                Eigen::MatrixXd& x, SparseCholesky::Workspace& workspace);

// The error of a rejected solve: kNotFinite when b or x is not finite, else kSingularMatrix with
// the backward error.
Error solve_refusal(const VecX& b, const VecX& x, const SolveQuality& quality);

}  // namespace brainshift::linalg
