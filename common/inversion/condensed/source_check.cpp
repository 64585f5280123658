// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/source_check.hpp"

#include <boost/math/special_functions/gamma.hpp>

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

// A direction of which the source knows a hundredth of what the others do is damped by half.
constexpr double kDamping = 0.01;

}  // namespace

bool SourceCheck::run(const blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                      const blas::In<double>& own_gram, const Eigen::Ref<const VecX>& own_right,
                      const Eigen::Ref<const VecX>& prior, Consistency& out) {
  const Eigen::Index n = gram.rows();
  factor_ = gram - own_gram;
  factor_.diagonal() += prior;
  if (!blas::cholesky(factor_)) return false;
  whitened_ = own_gram.selfadjointView<Eigen::Lower>();

  mean_ = right - own_right;
  blas::solve_lower(factor_, mean_);
  blas::solve_lower_transposed(factor_, mean_);
  score_ = own_right;
  score_.noalias() -= whitened_ * mean_;
  blas::solve_lower(factor_, score_);

  // M = L^-1 G L^-T: columns, then, as L^-1 G is half way, rows by the transpose.
  blas::solve_lower(factor_, whitened_);
  whitened_.transposeInPlace();
  blas::solve_lower(factor_, whitened_);
  score_covariance_ = whitened_;
  blas::multiply(1.0, whitened_, whitened_, 1.0, score_covariance_);
  score_covariance_.diagonal().array() += kDamping;
  if (!blas::cholesky(score_covariance_)) return false;

  inverse_.setIdentity(n, n);  // A = C^T C, C the inverse of the factor
  blas::solve_lower(score_covariance_, inverse_);
  const double trace = inverse_.squaredNorm();
  blas::gram(inverse_, 0.0, whitened_);
  double squares = 0.0;  // |A|_F^2 from its lower triangle
  for (Eigen::Index j = 0; j < n; ++j) {
    squares +=
        whitened_(j, j) * whitened_(j, j) + 2.0 * whitened_.col(j).tail(n - j - 1).squaredNorm();
  }
  blas::solve_lower(score_covariance_, score_);
  const auto size = static_cast<double>(n);
  const double mean = size - kDamping * trace;
  const double half_variance = size - 2.0 * kDamping * trace + kDamping * kDamping * squares;
  out.degrees_of_freedom = mean * mean / half_variance;
  out.chi_square = score_.squaredNorm() * mean / half_variance;
  out.p_value = boost::math::gamma_q(0.5 * out.degrees_of_freedom, 0.5 * out.chi_square);
  return true;
}

}  // namespace brainshift::inversion
