// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/mode_posterior.hpp"

#include <boost/math/special_functions/gamma.hpp>

#include <algorithm>
#include <cmath>

#include "common/linalg/growing_matrix.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

// A direction of which the source knows a hundredth of what the others do is damped by half.
constexpr double kDamping = 0.01;

// Parts in which columns are multiplied, whatever the number of threads is: kernels of BLAS round a
// column by where it stands.
constexpr long kParts = 4;

// body(begin, end) for each part of [0, count).
template <typename Body>
void in_parts(ThreadTeam& team, long count, Body&& body) {
  auto share = [&](int member) {
    for (long part = member; part < kParts; part += team.size()) {
      const long begin = count * part / kParts, end = count * (part + 1) / kParts;
      if (begin < end) body(begin, end);
    }
  };
  team.run(share);
}

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

ModePosterior::ModePosterior(ModeWindow window) : window_(window) {
  const Eigen::Index most = SparseData::kMaxCommonErrors + window.count;
  gram_storage_.resize(most * most);
  factor_storage_.resize(most * most);
  right_.setZero(most);
  solution_.setZero(most);
  scales_.setOnes(most);
  full_.setZero(most);
  z_.setZero(window.count);
  inverse_.resize(most, most);
}

void ModePosterior::reserve(int data) {
  if (3 * data <= jacobian_.rows()) return;
  linalg::replace(residual_, 3 * data);
  linalg::replace(changed_, 3 * data, ContactReduction::kMaxChanges);
  linalg::replace(jacobian_, 3 * data, SparseData::kMaxCommonErrors + window_.count + 1);
}

// J -= (A G_A Y - [A G_Q 0]) S, contact_reduction.hpp.
void ModePosterior::follow_changes(SampledOperators& sampled, const ContactReduction& reduction,
                                   ThreadTeam& team) {
  auto moved = changed_.topLeftCorner(rows_, reduction.changes());
  const auto contact = sampled.contact(reduction.active());
  const auto columns = reduction.change_columns();
  in_parts(team, moved.cols(), [&](long begin, long end) {
    blas::multiply(1.0, contact, columns.middleCols(begin, end - begin), 0.0,
                   moved.middleCols(begin, end - begin));
  });
  const auto left = sampled.contact(reduction.left());
  moved.leftCols(left.cols()) -= left;
  const auto sizes = reduction.change_sizes();
  team.split(sizes.cols(), [&](long begin, long end) {
    blas::multiply(-1.0, moved, sizes.middleCols(begin, end - begin), 1.0,
                   jacobian_.block(0, common_ + begin, rows_, end - begin));
  });
}

void ModePosterior::linearise(SampledOperators& sampled, const ContactReduction& reduction,
                              bool same_data, ThreadTeam& team) {
  common_ = sampled.common();
  common_variance_ = sampled.common_variance();
  rows_ = sampled.rows();
  const Eigen::Index r = window_.count, size = unknowns();
  auto j = jacobian_.topLeftCorner(rows_, size + 1);
  if (same_data && reduction.changes() > 0) {
    follow_changes(sampled, reduction, team);
  } else if (j = sampled.free_body(); reduction.size() > 0) {
    const auto contact = sampled.contact(reduction.active());
    const auto response = reduction.response();
    in_parts(team, r + 1, [&](long begin, long end) {
      blas::multiply(-1.0, contact, response.middleCols(begin, end - begin), 1.0,
                     j.middleCols(common_ + begin, end - begin));
    });
  }
  // Parts of the lower triangle with about as much work for each thread.
  Eigen::Map<Eigen::MatrixXd> gram(gram_storage_.data(), size, size);
  const auto columns = j.leftCols(size);
  const auto edge = [&](long part) {
    const double left = 1.0 - static_cast<double>(part) / static_cast<double>(team.size());
    return size - static_cast<Eigen::Index>(std::lround(std::sqrt(left) * double(size)));
  };
  team.split(team.size(), [&](long begin, long end) {
    const Eigen::Index first = edge(begin), count = edge(end) - first, below = size - first - count;
    auto own = gram.block(first, first, count, count);
    if (count == 0) return;
    blas::gram(columns.middleCols(first, count), 0.0, own);
    if (below == 0) return;
    blas::multiply_transposed(1.0, columns.rightCols(below), columns.middleCols(first, count), 0.0,
                              gram.block(first + count, first, below, count));
  });
  right_.head(size).noalias() = columns.transpose() * j.col(size);
}

void ModePosterior::fill_scales(const PriorStrengths& strengths) {
  for (int k = 0; k < common_; ++k) scales_[k] = common_sd(k, strengths.held_error());
  for (int i = 0; i < window_.count; ++i) scales_[common_ + i] = strengths.scale_of(i);
}

Status ModePosterior::minimise(const PriorStrengths& strengths) {
  const Eigen::Index size = unknowns();
  fill_scales(strengths);
  const auto scales = scales_.head(size);
  Eigen::Map<Eigen::MatrixXd> factor(factor_storage_.data(), size, size);
  for (Eigen::Index j = 0; j < size; ++j) {
    factor.col(j).tail(size - j) =
        scales[j] * scales.tail(size - j).cwiseProduct(gram().col(j).tail(size - j));
    factor(j, j) += 1.0;
  }
  if (!blas::cholesky(factor)) {
    return fail(ErrorCode::kNotFinite, "inversion: the normal equations are not positive definite");
  }
  auto x = solution_.head(size);
  x = scales.cwiseProduct(right_.head(size));
  blas::solve_lower(factor, x);
  blas::solve_lower_transposed(factor, x);
  x.array() *= scales.array();
  z_ = x.tail(window_.count);
  update_residual();
  return {};
}

void ModePosterior::whiten(const VecX& step, VecX& out) const {
  const Eigen::Index r = window_.count;
  out.resize(r);
  for (Eigen::Index i = 0; i < r; ++i) {
    const double s = scales_[common_ + i];
    full_[i] = s > 0.0 ? step[i] / s : 0.0;
  }
  // The common errors come first, so that the last block is the factor of the Schur complement.
  const auto factor_of_z = factor().bottomRightCorner(r, r);
  out.noalias() = factor_of_z.transpose().triangularView<Eigen::Upper>() * full_.head(r);
}

void ModePosterior::unwhiten(const VecX& image, VecX& step) const {
  const Eigen::Index r = window_.count;
  step = image;
  blas::solve_lower_transposed(factor().bottomRightCorner(r, r), step);
  step.array() *= scales_.segment(common_, r).array();
}

void ModePosterior::whitened_newton_step(const VecX& gradient, VecX& out) const {
  const Eigen::Index r = window_.count;
  out = -scales_.segment(common_, r).cwiseProduct(gradient);
  blas::solve_lower(factor().bottomRightCorner(r, r), out);
}

void ModePosterior::set_answer(const Eigen::Ref<const VecX>& change_of_common, const VecX& z) {
  solution_.head(common_) += change_of_common;
  solution_.segment(common_, window_.count) = z;
  update_residual();
}

void ModePosterior::update_residual() {
  residual_.head(rows_) = jacobian_.col(unknowns()).head(rows_);
  residual_.head(rows_).noalias() -= jacobian() * solution_.head(unknowns());
}

// With L L^T = I + S G S: k = size - tr (I + S G S)^-1 = size - |L^-1|^2.
ModePosterior::Misfit ModePosterior::misfit() {
  const Eigen::Index size = unknowns();
  auto inverse = inverse_.topLeftCorner(size, size);
  inverse.setIdentity();
  blas::solve_lower(factor(), inverse);
  const double k = static_cast<double>(size) - inverse.squaredNorm();
  const double n = static_cast<double>(rows_) - k;
  return {std::sqrt(residual_.head(rows_).squaredNorm() / n),
          std::sqrt(1.0 + 2.0 * std::sqrt(2.0 / n))};
}

void ModePosterior::solve_normal(Eigen::MatrixXd& x) const {
  const auto scales = scales_.head(unknowns());
  x.array().colwise() *= scales.array();
  blas::solve_lower(factor(), x);
  blas::solve_lower_transposed(factor(), x);
  x.array().colwise() *= scales.array();
}

double ModePosterior::residual_norm(const SampledOperators& sampled, int datum) const {
  const int first = sampled.first_row(datum);
  return residual_.segment(first, sampled.first_row(datum + 1) - first).norm();
}

double ModePosterior::misfit(const SampledOperators& sampled, int datum) const {
  double squares = 0.0;
  for (int row = sampled.first_row(datum); row < sampled.first_row(datum + 1); ++row) {
    const double value =
        residual_[row] + jacobian_.row(row).head(common_).dot(solution_.head(common_));
    squares += value * value;
  }
  return std::sqrt(squares);
}

bool ModePosterior::check_source(const SampledOperators& sampled, const PriorStrengths& strengths,
                                 const DataSource& source, SourceCheck& check,
                                 Consistency& out) const {
  const int first = sampled.first_row(source.first);
  const int count = sampled.first_row(source.first + source.count) - first;
  const Eigen::Index size = unknowns();
  const auto own = jacobian_.block(first, 0, count, size);
  check.own_gram_.resize(size, size);
  check.precision_.resize(size);
  blas::gram(own, 0.0, check.own_gram_);
  check.own_right_.noalias() = own.transpose() * jacobian_.col(size).segment(first, count);
  const auto run = [&](const Hypothesis& hypothesis, Consistency& result) {
    // The check wants the prior's information; that of an absent part is as good as infinite.
    constexpr double kAbsentScale = 1e-4;
    for (int i = 0; i < size; ++i) {
      const double scale = i < common_ ? common_sd(i, hypothesis.error)
                                       : strengths.scale_of(i - common_, hypothesis.scales);
      check.precision_[i] = std::pow(std::max(kAbsentScale, scale), -2);
    }
    return check.run(gram(), right_hand_side(), check.own_gram_, check.own_right_, check.precision_,
                     result);
  };
  const auto& hypotheses = strengths.hypotheses();
  if (!run(hypotheses.front(), out)) return false;
  if (out.p_value >= kInconsistent) return true;
  double mean = hypotheses.front().weight * out.p_value;
  double left = 1.0 - hypotheses.front().weight;
  for (std::size_t h = 1; h < hypotheses.size(); ++h) {
    if (mean >= kInconsistent || mean + left < kInconsistent) break;
    Consistency other;
    if (!run(hypotheses[h], other)) return false;
    mean += hypotheses[h].weight * other.p_value;
    left -= hypotheses[h].weight;
  }
  out.p_value = mean;
  return true;
}

}  // namespace brainshift::inversion
