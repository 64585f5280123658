// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/prior_strengths.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;
using Eigen::MatrixXd;

// What L may leave out of the trace of G, at the greatest strengths. It bounds the change of ln p.
constexpr double kTruncatedTrace = 0.05;
constexpr int kMaxSteps = 60;
constexpr double kLeastGain = 1e-9;
// A hypothesis of less weight than this changes nothing that anyone sees; of the others, so many
// are kept.
constexpr double kLeastWeight = 0.01;
constexpr std::size_t kMostHypotheses = 20;
// Makes the covariance of absent parts, which is zero, positive definite.
constexpr double kJitter = 1e-12;

std::array<double, kStrengths.size()> log_prior() {
  std::array<double, kStrengths.size()> result{};
  double sum = 0.0;
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    const double log_strength = std::log(kStrengths[i]) / kLogStrengthSd;
    result[i] = std::exp(-0.5 * log_strength * log_strength);
    sum += result[i];
  }
  result[0] = std::log(kAbsent);
  for (std::size_t i = 1; i < kStrengths.size(); ++i) {
    result[i] = std::log((1.0 - kAbsent) * result[i] / sum);
  }
  return result;
}

std::size_t index_of(double strength) {
  return static_cast<std::size_t>(std::find(kStrengths.begin(), kStrengths.end(), strength) -
                                  kStrengths.begin());
}

tl::unexpected<Error> not_finite() {
  return fail(ErrorCode::kNotFinite,
              "inversion: the evidence of the prior's strengths is not finite");
}

}  // namespace

PriorStrengths::PriorStrengths(const PerPart<int>& columns, ModeWindow window, int max_common,
                               bool estimate)
    : window_(window), estimate_(estimate), max_common_(max_common), log_prior_(log_prior()) {
  int column = 0;
  for (std::size_t part = 0; part < columns.size(); ++part) {
    first_[part] = static_cast<int>(part_of_mode_.size());
    for (int i = 0; i < columns[part]; ++i, ++column) {
      if (column < window.first || column >= window.first + window.count) continue;
      part_of_mode_.push_back(part);
    }
    count_[part] = static_cast<int>(part_of_mode_.size()) - first_[part];
  }
  hypotheses_.reserve(kMostHypotheses);
  candidates_.reserve((1 + kPriorParts) * kPriorParts * kStrengths.size());
  reset();
}

void PriorStrengths::reset() {
  hypotheses_.assign(1, {as_in_the_case(), 1.0});
  floor_ = {};
  size_ = 0;
}

bool PriorStrengths::weighed_for(const blas::In<double>& gram,
                                 const Eigen::Ref<const VecX>& right) const {
  if (gram.rows() != size_ || right != right_) return false;
  for (Eigen::Index j = 0; j < size_; ++j) {
    if (gram.col(j).tail(size_ - j) != gram_.col(j).tail(size_ - j)) return false;
  }
  return true;
}

// 0 for parts that the window does not have.
PriorScaleValues PriorStrengths::as_in_the_case() const {
  PriorScaleValues scales = kAsInTheCase;
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] == 0) scales[part] = 0.0;
  }
  return scales;
}

// G = L L^T, the column of the largest remaining diagonal next. In units of the greatest strengths.
bool PriorStrengths::compress(const blas::In<double>& gram, const Eigen::Ref<const VecX>& right) {
  size_ = gram.rows();
  common_ = size_ - window_.count;
  if (!gram.diagonal().allFinite() || !right.allFinite()) return false;
  gram_ = gram;
  right_ = right;
  const auto greatest = [&](Eigen::Index i) { return i < common_ ? 1.0 : kLargestStrength; };
  residual_diagonal_ = gram.diagonal();
  for (Eigen::Index i = 0; i < size_; ++i) residual_diagonal_[i] *= greatest(i) * greatest(i);
  if (left_.rows() < size_) {
    left_.resize(max_common_ + window_.count, max_common_ + window_.count);
    row_.resize(left_.cols());
  }
  pivots_.clear();
  rank_ = 0;
  while (rank_ < size_ && residual_diagonal_.sum() > kTruncatedTrace) {
    Eigen::Index pivot = 0;
    const double largest = residual_diagonal_.maxCoeff(&pivot);
    if (!(largest > 0.0)) break;
    auto column = left_.col(rank_).head(size_);
    column.head(pivot) = gram.row(pivot).head(pivot).transpose();
    column.tail(size_ - pivot) = gram.col(pivot).tail(size_ - pivot);
    auto row = row_.head(rank_);
    row = left_.row(pivot).head(rank_).transpose();
    column.noalias() -= left_.topLeftCorner(size_, rank_) * row;
    for (const Eigen::Index done : pivots_) column[done] = 0.0;
    const double diagonal = largest / (greatest(pivot) * greatest(pivot));
    column /= std::sqrt(diagonal);
    for (Eigen::Index i = 0; i < size_; ++i) {
      residual_diagonal_[i] =
          std::max(0.0, residual_diagonal_[i] - std::pow(greatest(i) * column[i], 2));
    }
    residual_diagonal_[pivot] = 0.0;
    pivots_.push_back(pivot);
    ++rank_;
  }
  y_.resize(rank_);
  for (Eigen::Index k = 0; k < rank_; ++k) {
    const Eigen::Index row = pivots_[static_cast<std::size_t>(k)];
    y_[k] = (right[row] - left_.row(row).head(k).dot(y_.head(k))) / left_(row, k);
  }
  const auto square = [&](Eigen::Index first, Eigen::Index count, linalg::GrowingMatrix& out) {
    out.resize(rank_, rank_);
    out.setZero();
    if (count > 0 && rank_ > 0) blas::gram(left_.block(first, 0, count, rank_), 0.0, out);
  };
  square(0, common_, of_common_);
  for (std::size_t part = 0; part < count_.size(); ++part) {
    square(common_ + first_[part], count_[part], of_part_[part]);
  }
  return y_.allFinite();
}

void PriorStrengths::fill_omega(const PriorScaleValues& scales) {
  omega_ = of_common_;
  omega_.diagonal().array() += 1.0;
  for (std::size_t part = 0; part < count_.size(); ++part) {
    const double square = variance(part, scales);
    if (count_[part] == 0 || square == 0.0) continue;
    omega_ += square * of_part_[part];
  }
}

// With Omega of all parts, X = K^-1 L^T, K K^T = Omega: for part g
//   M = X_g^T X_g,   b = X_g^T K^-1 y,   N = I - s_g^2 M
// and without the part M' = N^-1 M, b' = N^-1 b (Woodbury), so that its strength t has
//   ln p = const + 1/2 ln |N| - 1/2 ln |I + t^2 M'| + 1/2 t^2 b' (I + t^2 M')^-1 b'.
bool PriorStrengths::profiles(const PriorScaleValues& scales, PerPart<Profile>& out) {
  fill_omega(scales);
  if (rank_ > 0 && !blas::cholesky(omega_)) return false;
  whitened_ = y_;
  scratch_ = left_.topLeftCorner(size_, rank_).transpose();
  if (rank_ > 0) {
    blas::solve_lower(omega_, whitened_);
    blas::solve_lower(omega_, scratch_);
  }
  for (std::size_t part = 0; part < count_.size(); ++part) {
    const Eigen::Index count = count_[part];
    if (count == 0) continue;
    const auto x = scratch_.middleCols(common_ + first_[part], count);
    solved_.resize(count, count);
    solved_.setZero();
    if (rank_ > 0) blas::gram(x, 0.0, solved_);
    solved_.triangularView<Eigen::StrictlyUpper>() = solved_.transpose();
    projected_.resize(count);
    projected_.noalias() = x.transpose() * whitened_;
    const double own = variance(part, scales);
    if (own > 0.0) {
      small_ = -own * solved_;
      small_.diagonal().array() += 1.0;
      if (!blas::cholesky(small_)) return false;
      blas::solve_lower(small_, solved_);
      blas::solve_lower_transposed(small_, solved_);
      blas::solve_lower(small_, projected_);
      blas::solve_lower_transposed(small_, projected_);
    }
    for (std::size_t i = 0; i < kStrengths.size(); ++i) {
      const double square = kStrengths[i] * kStrengths[i] + floor_[part] * floor_[part];
      out[part][i] = log_prior_[i];
      if (square == 0.0) continue;
      small_ = square * solved_;
      small_.diagonal().array() += 1.0;
      if (!blas::cholesky(small_)) return false;
      mean_of_ = std::sqrt(square) * projected_;
      blas::solve_lower(small_, mean_of_);
      out[part][i] += 0.5 * mean_of_.squaredNorm() - small_.diagonal().array().log().sum();
    }
  }
  return true;
}

bool PriorStrengths::ascend(PriorScaleValues& scales) {
  for (int step = 0; step < kMaxSteps; ++step) {
    double gain = 0.0;
    std::size_t best_part = 0, best_strength = 0;
    if (!profiles(scales, profiles_)) return false;
    for (std::size_t part = 0; part < count_.size(); ++part) {
      if (count_[part] == 0) continue;
      const Profile& log_p = profiles_[part];
      const auto best = std::max_element(log_p.begin(), log_p.end());
      if (*best - log_p[index_of(scales[part])] <= gain) continue;
      gain = *best - log_p[index_of(scales[part])];
      best_part = part;
      best_strength = static_cast<std::size_t>(best - log_p.begin());
    }
    if (gain <= kLeastGain) return true;
    scales[best_part] = kStrengths[best_strength];
  }
  return true;
}

double PriorStrengths::log_posterior(const PriorScaleValues& scales) {
  fill_omega(scales);
  if (rank_ > 0 && !blas::cholesky(omega_)) return -std::numeric_limits<double>::infinity();
  double sum = 0.0;
  if (rank_ > 0) {
    whitened_ = y_;
    blas::solve_lower(omega_, whitened_);
    sum = -omega_.diagonal().array().log().sum() - 0.5 * whitened_.squaredNorm();
  }
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] > 0) sum += log_prior_[index_of(scales[part])];
  }
  return sum;
}

bool PriorStrengths::weigh(const PriorScaleValues& best) {
  return profiles(best, profiles_) && take_neighbours(best);
}

void PriorStrengths::gather_neighbours(const PerPart<Profile>& log_p, const PriorScaleValues& from,
                                       double log_weight) {
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] == 0) continue;
    const std::size_t own = index_of(from[part]);
    for (std::size_t i = 0; i < kStrengths.size(); ++i) {
      if (i == own) continue;
      candidates_.push_back({from, log_weight + log_p[part][i] - log_p[part][own]});
      candidates_.back().scales[part] = kStrengths[i];
    }
  }
}

// Of the hypothesis whose profiles_ are given.
bool PriorStrengths::take_neighbours(const PriorScaleValues& best) {
  candidates_.clear();
  gather_neighbours(profiles_, best, 0.0);
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] == 0) continue;
    const Profile& log_p = profiles_[part];
    const std::size_t own = index_of(best[part]);
    const auto other = own > 0
                           ? 0
                           : static_cast<std::size_t>(
                                 std::max_element(log_p.begin() + 1, log_p.end()) - log_p.begin());
    PriorScaleValues changed = best;
    changed[part] = kStrengths[other];
    if (!profiles(changed, changed_profiles_)) return false;
    gather_neighbours(changed_profiles_, changed, log_p[other] - log_p[own]);
  }
  std::sort(candidates_.begin(), candidates_.end(), [](const Hypothesis& a, const Hypothesis& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.scales < b.scales;
  });
  hypotheses_.assign(1, {best, 1.0});
  for (const Hypothesis& each : candidates_) {
    if (hypotheses_.size() >= kMostHypotheses) break;
    // The same pair of changes may come in either order.
    const bool known =
        std::any_of(hypotheses_.begin(), hypotheses_.end(),
                    [&](const Hypothesis& other) { return other.scales == each.scales; });
    if (!known) hypotheses_.push_back({each.scales, std::exp(each.weight)});
  }
  const auto sum = [&] {
    double total = 0.0;
    for (const Hypothesis& each : hypotheses_) total += each.weight;
    return total;
  };
  const double all = sum();
  while (hypotheses_.size() > 1 && hypotheses_.back().weight < kLeastWeight * all) {
    hypotheses_.pop_back();
  }
  const double kept = sum();
  for (Hypothesis& each : hypotheses_) each.weight /= kept;
  return true;
}

bool PriorStrengths::search(PriorScaleValues& best) {
  best = {};
  PriorScaleValues from_all = as_in_the_case();
  if (!ascend(best) || !ascend(from_all)) return false;
  if (log_posterior(from_all) > log_posterior(best)) best = from_all;
  return true;
}

bool PriorStrengths::climb() {
  for (int step = 0; step < kMaxSteps && gain() > kLeastGain; ++step) {
    PriorScaleValues next = candidates_.front().scales;
    if (!ascend(next) || !weigh(next)) return false;
  }
  return true;
}

Status PriorStrengths::fit(const blas::In<double>& gram, const Eigen::Ref<const VecX>& right) {
  if (!compress(gram, right)) return not_finite();
  if (!estimate_) return {};
  PriorScaleValues best;
  if (!search(best) || !weigh(best) || !climb()) return not_finite();
  return {};
}

Result<bool> PriorStrengths::refit(const blas::In<double>& gram,
                                   const Eigen::Ref<const VecX>& right, bool may_change) {
  if (!weighed_for(gram, right)) {
    const PriorScaleValues same = held();
    if (!compress(gram, right)) return not_finite();
    if (estimate_ && !weigh(same)) return not_finite();
  }
  if (!estimate_ || !may_change || gain() <= kWorthwhile) return false;
  if (!climb()) return not_finite();
  return true;
}

bool PriorStrengths::mean_shift(Eigen::Ref<VecX> out) {
  const auto hypotheses = static_cast<Eigen::Index>(hypotheses_.size());
  means_.resize(size_, hypotheses + 1);
  auto mean = means_.col(hypotheses);
  mean.setZero();
  for (Eigen::Index h = 0; h < hypotheses; ++h) {
    const Hypothesis& each = hypotheses_[static_cast<std::size_t>(h)];
    fill_omega(each.scales);
    if (rank_ > 0 && !blas::cholesky(omega_)) return false;
    whitened_ = y_;
    if (rank_ > 0) {
      blas::solve_lower(omega_, whitened_);
      blas::solve_lower_transposed(omega_, whitened_);
    }
    // m = S^2 L Omega^-1 y
    means_.col(h).noalias() = left_.topLeftCorner(size_, rank_) * whitened_;
    for (int i = 0; i < window_.count; ++i) {
      means_(common_ + i, h) *= variance(part_of_mode_[static_cast<std::size_t>(i)], each.scales);
    }
    mean += each.weight * means_.col(h);
  }
  out = mean - means_.col(0);
  return out.allFinite();
}

bool PriorStrengths::covariance(blas::Out<double> factor) {
  const Eigen::Index r = window_.count, hypotheses = means_.cols() - 1;
  covariance_.setZero(r, r);
  for (Eigen::Index h = 0; h < hypotheses; ++h) {
    const Hypothesis& each = hypotheses_[static_cast<std::size_t>(h)];
    fill_omega(each.scales);
    if (rank_ > 0 && !blas::cholesky(omega_)) return false;
    // X = K^-1 L^T S^2 with K K^T = Omega; C = S^2 - X^T X
    solved_ = left_.block(common_, 0, r, rank_).transpose();
    for (int i = 0; i < r; ++i) {
      const double square = variance(part_of_mode_[static_cast<std::size_t>(i)], each.scales);
      solved_.col(i) *= std::sqrt(each.weight) * square;
      covariance_(i, i) += each.weight * square;
    }
    if (rank_ > 0) {
      blas::solve_lower(omega_, solved_);
      blas::gram(solved_, 0.0, factor);
      covariance_.triangularView<Eigen::Lower>() -= factor;
    }
    if (hypotheses == 1) break;
    mean_of_ = (means_.col(h) - means_.col(hypotheses)).tail(r);
    for (Eigen::Index j = 0; j < r; ++j) {
      covariance_.col(j).tail(r - j) += each.weight * mean_of_[j] * mean_of_.tail(r - j);
    }
  }
  covariance_.diagonal().array() += kJitter * (1.0 + covariance_.diagonal().maxCoeff());
  factor = covariance_.triangularView<Eigen::Lower>();
  return blas::cholesky(factor);
}

PriorScaleValues PriorStrengths::mean() const {
  PriorScaleValues result{};
  for (const Hypothesis& each : hypotheses_) {
    for (std::size_t g = 0; g < result.size(); ++g) result[g] += each.weight * each.scales[g];
  }
  return result;
}

PriorScaleValues PriorStrengths::mean_square() const {
  PriorScaleValues result{};
  for (const Hypothesis& each : hypotheses_) {
    for (std::size_t g = 0; g < result.size(); ++g) {
      result[g] += each.weight * variance(g, each.scales);
    }
  }
  return result;
}

PriorScaleValues PriorStrengths::absent() const {
  PriorScaleValues result{};
  for (const Hypothesis& each : hypotheses_) {
    for (std::size_t g = 0; g < result.size(); ++g) {
      if (each.scales[g] == 0.0) result[g] += each.weight;
    }
  }
  return result;
}

PerPart<bool> PriorStrengths::at_bound() const {
  PerPart<bool> result{};
  for (std::size_t g = 0; estimate_ && g < result.size(); ++g) {
    result[g] = held()[g] >= kLargestStrength;
  }
  return result;
}

}  // namespace brainshift::inversion
