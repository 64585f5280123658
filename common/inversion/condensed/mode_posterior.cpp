// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/mode_posterior.hpp"

#include <cmath>

#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

namespace blas = linalg::blas;

ModePosterior::ModePosterior(ModeWindow window) : window_(window) {
  const Eigen::Index most = SparseData::kMaxCommonErrors + window.count;
  gram_storage_.resize(most * most);
  factor_storage_.resize(most * most);
  right_.setZero(most);
  solution_.setZero(most);
  prior_.setOnes(most);
  z_.setZero(window.count);
}

void ModePosterior::reserve(int data) {
  if (3 * data <= jacobian_.rows()) return;
  jacobian_.resize(3 * data, SparseData::kMaxCommonErrors + window_.count + 1);
  residual_.resize(3 * data);
}

void ModePosterior::fill_prior(const PriorScales& scales) {
  prior_.head(common_).setOnes();
  for (int i = 0; i < window_.count; ++i) {
    const double scale = scales.of_mode(i);
    prior_[common_ + i] = 1.0 / (scale * scale);
  }
}

Status ModePosterior::solve(SampledOperators& sampled, const ContactReduction& reduction,
                            const PriorScales& scales, ThreadTeam& team) {
  common_ = sampled.common();
  rows_ = sampled.rows();
  const Eigen::Index r = window_.count, size = unknowns();
  auto j = jacobian_.topLeftCorner(rows_, size + 1);
  j = sampled.free_body();
  if (reduction.size() > 0) {
    const auto contact = sampled.contact(reduction.active());
    const auto response = reduction.response();
    team.split(r + 1, [&](long begin, long end) {
      blas::multiply(-1.0, contact, response.middleCols(begin, end - begin), 1.0,
                     j.middleCols(common_ + begin, end - begin));
    });
  }
  Eigen::Map<Eigen::MatrixXd> gram(gram_storage_.data(), size, size);
  Eigen::Map<Eigen::MatrixXd> factor(factor_storage_.data(), size, size);
  blas::gram(j.leftCols(size), 0.0, gram);
  fill_prior(scales);
  factor = gram;
  factor.diagonal() += prior_.head(size);
  if (!blas::cholesky(factor)) {
    return fail(ErrorCode::kNotFinite, "inversion: the normal equations are not positive definite");
  }
  right_.head(size).noalias() = j.leftCols(size).transpose() * j.col(size);
  auto cz = solution_.head(size);
  cz = right_.head(size);
  blas::solve_lower(factor, cz);
  blas::solve_lower_transposed(factor, cz);
  z_ = cz.tail(r);
  residual_.head(rows_) = j.col(size);
  residual_.head(rows_).noalias() -= j.leftCols(size) * cz;
  misfit_ratio_ = std::sqrt(residual_.head(rows_).squaredNorm() / static_cast<double>(rows_));
  return {};
}

double ModePosterior::residual_norm(const SampledOperators& sampled, int datum) const {
  const int first = sampled.first_row(datum);
  return residual_.segment(first, sampled.first_row(datum + 1) - first).norm();
}

double ModePosterior::misfit(const SampledOperators& sampled, int datum) const {
  double squares = 0.0;
  for (int row = sampled.first_row(datum); row < sampled.first_row(datum + 1); ++row) {
    const double value = residual_[row] + jacobian_.row(row).head(common_).dot(common_amplitudes());
    squares += value * value;
  }
  return std::sqrt(squares);
}

bool ModePosterior::check_source(const SampledOperators& sampled, const PriorScales& scales,
                                 const DataSource& source, Consistency& out) {
  const int first = sampled.first_row(source.first);
  const int count = sampled.first_row(source.first + source.count) - first;
  const Eigen::Index size = unknowns();
  const auto own = jacobian_.block(first, 0, count, size);
  own_gram_.resize(size, size);
  blas::gram(own, 0.0, own_gram_);
  own_right_.noalias() = own.transpose() * jacobian_.col(size).segment(first, count);
  fill_prior(scales);
  return check_.run(gram(), right_hand_side(), own_gram_, own_right_, prior_.head(size), out);
}

}  // namespace brainshift::inversion
