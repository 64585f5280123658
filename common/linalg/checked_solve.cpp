// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/checked_solve.hpp"

#include <fmt/format.h>

#include <limits>

#include "common/core/random.hpp"

namespace brainshift::linalg {
namespace {

constexpr std::uint64_t kSeed = 19670401;  // any fixed number

// Maximum norm; NaN when the vector holds a NaN or an infinity, which Eigen's maximum can hide.
double max_abs(const VecX& v) {
  return v.allFinite() ? v.lpNorm<Eigen::Infinity>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Error solve_refusal(const VecX& b, const VecX& x, const SolveQuality& quality) {
  if (!b.allFinite()) return {ErrorCode::kNotFinite, "solve: the right-hand side is not finite"};
  if (!x.allFinite()) return {ErrorCode::kNotFinite, "solve: the solution is not finite"};
  return {ErrorCode::kSingularMatrix,
          fmt::format("solve: backward error {:g} after {} refinements is above {:g}; the factor "
                      "does not belong to the matrix",
                      quality.backward_error, quality.refinements, kRefuseAbove)};
}

double backward_error(const SymmetricMatrix& lower, double norm, const VecX& b, const VecX& x,
                      VecX& product) {
  product.noalias() = lower.selfadjointView<Eigen::Lower>() * x;
  const double scale = norm * max_abs(x) + max_abs(b);
  if (scale == 0.0) return 0.0;
  return max_abs(b - product) / scale;
}

Result<SolveQuality> checked_solve(const SymmetricMatrix& lower, double norm,
                                   const SparseCholesky& factor, const VecX& b, VecX& x) {
  factor.solve(b, x);
  SolveQuality quality;
  VecX product, better, correction;
  quality.backward_error = backward_error(lower, norm, b, x, product);
  while (quality.backward_error > kRefineAbove && quality.refinements < kMaxRefinements) {
    factor.solve(VecX(b - product), correction);
    better = x + correction;
    const double error = backward_error(lower, norm, b, better, product);
    ++quality.refinements;
    if (!(error < quality.backward_error)) break;  // as good as this factor gets
    x.swap(better);
    quality.backward_error = error;
  }
  if (!(quality.backward_error <= kRefuseAbove))
    return tl::unexpected(solve_refusal(b, x, quality));
  return quality;
}

Result<SolveQuality> check_rows(const SymmetricMatrix& lower, double norm,
                                const SparseCholesky& factor, const Eigen::MatrixXd& b,
                                Eigen::MatrixXd& x, SparseCholesky::Workspace& workspace) {
  Random random(kSeed);
  VecX signs(b.rows()), product;
  for (Eigen::Index j = 0; j < signs.size(); ++j) signs[j] = random.uniform() < 0.5 ? -1.0 : 1.0;
  const VecX rhs = b.transpose() * signs;
  SolveQuality quality;
  VecX combined = x.transpose() * signs;
  quality.backward_error = backward_error(lower, norm, rhs, combined, product);
  Eigen::MatrixXd residual, correction;
  while (quality.backward_error > kRefineAbove && quality.refinements < kMaxRefinements) {
    residual.resizeLike(b);
    for (Eigen::Index j = 0; j < b.rows(); ++j) {
      const VecX row = x.row(j).transpose();
      product.noalias() = lower.selfadjointView<Eigen::Lower>() * row;
      residual.row(j) = b.row(j) - product.transpose();
    }
    factor.solve_rows(residual, correction, workspace);
    ++quality.refinements;
    combined.noalias() = (x + correction).transpose() * signs;
    const double error = backward_error(lower, norm, rhs, combined, product);
    if (!(error < quality.backward_error)) break;
    x += correction;
    quality.backward_error = error;
  }
  if (!(quality.backward_error <= kRefuseAbove)) {
    return tl::unexpected(solve_refusal(rhs, combined, quality));
  }
  return quality;
}

}  // namespace brainshift::linalg
