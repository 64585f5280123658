// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/outline_errors.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

namespace brainshift::registration {
namespace {

using Eigen::MatrixXd;

constexpr double kShort_mm = 5.0, kLong_mm = 10.0, kLargest_mm = 0.5;
static_assert(kOutlineErrors.front().length_mm == kShort_mm &&
              kOutlineErrors.back().length_mm == kLong_mm &&
              kOutlineErrors.back().sd_mm == kLargest_mm);
// Of the trace: what the columns may leave out of the smooth part, and its factor before.
constexpr double kLeftOut = 0.02, kLeftOutOfFactor = 1e-3;
constexpr Eigen::Index kMaxPivots = 100;

double covariance(const Points& places, Eigen::Index i, Eigen::Index j, double length_mm) {
  return std::exp(-0.5 * (places.col(i) - places.col(j)).squaredNorm() / (length_mm * length_mm));
}

// Pivoted Cholesky factor of the covariance of the shortest length.
MatrixXd factor_of(const Points& places) {
  const Eigen::Index m = places.cols(), most = std::min(m, kMaxPivots);
  MatrixXd factor(m, most);
  VecX left = VecX::Ones(m);
  Eigen::Index made = 0;
  for (; made < most && left.sum() > kLeftOutOfFactor * static_cast<double>(m); ++made) {
    Eigen::Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    auto column = factor.col(made);
    for (Eigen::Index i = 0; i < m; ++i) column[i] = covariance(places, i, pivot, kShort_mm);
    column.noalias() -= factor.leftCols(made) * factor.row(pivot).head(made).transpose();
    column /= std::sqrt(largest);
    left = (left - column.cwiseAbs2()).cwiseMax(0.0);
  }
  return factor.leftCols(made);
}

}  // namespace

OutlineErrors outline_errors(const Points& places) {
  const Eigen::Index m = places.cols();
  OutlineErrors result;
  if (m == 0) return result;
  const Vec3 centre = places.rowwise().mean();
  const double radius_mm = std::sqrt((places.colwise() - centre).colwise().squaredNorm().mean());
  if (radius_mm < kLeastRadius * kShort_mm) return result;
  const Eigen::Index hypotheses = std::count_if(
      kOutlineErrors.begin(), kOutlineErrors.end(),
      [&](const OutlineError& each) { return radius_mm >= kLeastRadius * each.length_mm; });
  const MatrixXd factor = factor_of(places);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> smooth(factor.transpose() * factor);  // ascending
  Eigen::Index k = 0;
  double left = smooth.eigenvalues().sum();
  const double enough = kLeftOut * left;
  for (; k < std::min<Eigen::Index>(factor.cols(), kMaxOutlineColumns) && left > enough; ++k) {
    left -= smooth.eigenvalues()[factor.cols() - 1 - k];
  }
  const VecX roots = smooth.eigenvalues().tail(k).cwiseSqrt();
  const MatrixXd scaled = factor * smooth.eigenvectors().rightCols(k);  // U Lambda^1/2
  // Lambda^-1/2 U^T K U Lambda^-1/2
  const MatrixXd whitening = scaled * roots.cwiseAbs2().cwiseInverse().asDiagonal();
  MatrixXd smoother(m, m);
  for (Eigen::Index j = 0; j < m; ++j) {
    for (Eigen::Index i = 0; i < m; ++i) smoother(i, j) = covariance(places, i, j, kLong_mm);
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> both(whitening.transpose() * smoother * whitening);
  const VecX of_long = both.eigenvalues().cwiseMax(0.0);
  const VecX largest = of_long.cwiseMax(1.0);
  result.columns = kLargest_mm * (scaled * both.eigenvectors()) * largest.cwiseSqrt().asDiagonal();
  result.variances.resize(k, hypotheses);
  for (Eigen::Index e = 0; e < hypotheses; ++e) {
    const OutlineError& error = kOutlineErrors[static_cast<std::size_t>(e)];
    const bool is_long = error.length_mm == kLong_mm;
    result.variances.col(e) = std::pow(error.sd_mm / kLargest_mm, 2) *
                              (is_long ? of_long : VecX::Ones(k)).cwiseQuotient(largest);
  }
  return result;
}

}  // namespace brainshift::registration
