// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/strengths/strength_evidence.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/linalg/column_sums.hpp"

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

// What L may leave out of the trace of G, at the greatest strengths. It bounds the change of ln p.
constexpr double kTruncatedTrace = 0.05;
// What W_g may leave out of the trace of L_g^T L_g, in the same units.
constexpr double kTruncatedPart = 1e-3;
constexpr double kGreatestVariance = kLargestStrength * kLargestStrength;

}  // namespace

StrengthEvidence::StrengthEvidence(const PerPart<int>& counts, int max_common)
    : count_(counts), max_common_(max_common) {
  for (std::size_t part = 0; part < counts.size(); ++part) {
    first_[part] = modes_;
    modes_ += counts[part];
  }
}

bool StrengthEvidence::holds(const blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                             const Eigen::MatrixXd& common_variance) const {
  if (gram.rows() != size_ || right != right_ ||
      common_variance.cols() != common_variance_.cols() || common_variance != common_variance_) {
    return false;
  }
  for (Eigen::Index j = 0; j < size_; ++j) {
    if (gram.col(j).tail(size_ - j) != gram_.col(j).tail(size_ - j)) return false;
  }
  return true;
}

bool StrengthEvidence::take(const blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                            const Eigen::MatrixXd& common_variance) {
  size_ = gram.rows();
  common_ = size_ - modes_;
  if (!gram.diagonal().allFinite() || !right.allFinite()) return false;
  gram_ = gram;
  right_ = right;
  common_variance_ = common_variance;
  if (left_.rows() < size_) {
    left_.resize(max_common_ + modes_, max_common_ + modes_);
    row_.resize(left_.cols());
  }
  factorise(gram);
  y_.resize(rank_);
  for (Eigen::Index k = 0; k < rank_; ++k) {
    const Eigen::Index row = pivots_[static_cast<std::size_t>(k)];
    y_[k] = (right[row] - left_.row(row).head(k).dot(y_.head(k))) / left_(row, k);
  }
  const auto square = [&](const auto& rows, linalg::GrowingMatrix& out) {
    out.resize(rank_, rank_);
    out.setZero();
    if (rows.rows() > 0 && rank_ > 0) blas::gram(rows, 0.0, out);
  };
  for (int e = 0; e < errors(); ++e) {
    scaled_ = left_.topLeftCorner(common_, rank_);
    if (common_variance_.cols() > 0) {
      scaled_.array().colwise() *= common_variance_.col(e).array().sqrt();
    }
    square(scaled_, of_common_[static_cast<std::size_t>(e)]);
  }
  for (std::size_t part = 0; part < count_.size(); ++part) {
    square(left_.block(common_ + first_[part], 0, count_[part], rank_), of_part_[part]);
  }
  factorise_parts();
  return y_.allFinite();
}

// The column of the largest remaining diagonal next. In units of the greatest strengths.
void StrengthEvidence::factorise(const blas::In<double>& gram) {
  const auto greatest = [&](Eigen::Index i) { return i < common_ ? 1.0 : kLargestStrength; };
  left_out_ = gram.diagonal();
  for (Eigen::Index i = 0; i < size_; ++i) left_out_[i] *= greatest(i) * greatest(i);
  pivots_.clear();
  rank_ = 0;
  while (rank_ < size_ && left_out_.sum() > kTruncatedTrace) {
    Eigen::Index pivot = 0;
    const double largest = left_out_.maxCoeff(&pivot);
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
      left_out_[i] = std::max(0.0, left_out_[i] - std::pow(greatest(i) * column[i], 2));
    }
    left_out_[pivot] = 0.0;
    pivots_.push_back(pivot);
    ++rank_;
  }
}

// By pivoted Cholesky factorisation again, of the lower triangle of L_g^T L_g.
void StrengthEvidence::factorise_parts() {
  if (roots_.rows() < rank_) roots_.resize(max_common_ + modes_, modes_);
  Eigen::Index first = 0;
  for (std::size_t part = 0; part < count_.size(); ++part) {
    first_root_[part] = first;
    rest_ = of_part_[part];
    auto diagonal = left_out_.head(rank_);
    diagonal = rest_.diagonal();
    Eigen::Index made = 0;
    while (made < count_[part] && rank_ > 0 &&
           kGreatestVariance * diagonal.sum() > kTruncatedPart) {
      Eigen::Index pivot = 0;
      const double largest = diagonal.maxCoeff(&pivot);
      if (!(largest > 0.0)) break;
      auto column = roots_.col(first + made).head(rank_);
      column.head(pivot) = rest_.row(pivot).head(pivot).transpose();
      column.tail(rank_ - pivot) = rest_.col(pivot).tail(rank_ - pivot);
      auto row = row_.head(made);
      row = roots_.row(pivot).segment(first, made).transpose();
      column.noalias() -= roots_.block(0, first, rank_, made) * row;
      column /= std::sqrt(largest);
      for (Eigen::Index i = 0; i < rank_; ++i) {
        diagonal[i] = std::max(0.0, diagonal[i] - column[i] * column[i]);
      }
      diagonal[pivot] = 0.0;
      ++made;
    }
    root_count_[part] = made;
    first += made;
  }
  roots_in_all_ = first;
}

bool StrengthEvidence::fill_omega(const Variances& variances, linalg::GrowingMatrix& omega) const {
  omega.resize(rank_, rank_);
  PerPart<double> factors{};
  PerPart<const double*> parts{}, columns{};
  std::size_t present = 0;
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] == 0 || variances[part] == 0.0) continue;
    factors[present] = variances[part];
    parts[present++] = of_part_[part].data();
  }
  for (Eigen::Index j = 0; j < rank_; ++j) {
    auto column = omega.col(j).tail(rank_ - j);
    column = of_common_[static_cast<std::size_t>(variances.error)].col(j).tail(rank_ - j);
    column[0] += 1.0;
    for (std::size_t i = 0; i < present; ++i) columns[i] = parts[i] + rank_ * j;
    linalg::add_columns(columns.data(), factors.data(), present, j, rank_ - j, column.data());
  }
  return rank_ == 0 || blas::cholesky(omega);
}

bool StrengthEvidence::log_evidence(const Variances& variances, Workspace& work,
                                    double& out) const {
  if (!fill_omega(variances, work.omega)) return false;
  work.whitened = y_;
  work.omega.triangularView<Eigen::Lower>().solveInPlace(work.whitened);
  // The density of y times |Omega|^1/2 exp(y^T y / 2) is what d says.
  out = -work.omega.diagonal().array().log().sum() - 0.5 * work.whitened.squaredNorm();
  return std::isfinite(out);
}

bool StrengthEvidence::project(const Variances& variances, Blocks blocks, Projection& out,
                               Workspace& work) const {
  if (!fill_omega(variances, work.omega)) return false;
  const Eigen::Index columns = roots_in_all_;
  out.whitened_parts = roots_.topLeftCorner(rank_, columns);
  out.parts.resize(columns, columns);
  out.data.resize(columns);
  if (columns == 0) return true;
  work.whitened = y_;
  work.omega.triangularView<Eigen::Lower>().solveInPlace(work.whitened);
  blas::solve_lower(work.omega, out.whitened_parts);
  if (blocks == Blocks::kAll) {
    blas::gram(out.whitened_parts, 0.0, out.parts);
  } else {
    for (std::size_t part = 0; part < count_.size(); ++part) {
      const Eigen::Index first = first_root_[part], count = root_count_[part];
      if (count == 0) continue;
      blas::gram(out.whitened_parts.middleCols(first, count), 0.0,
                 out.parts.block(first, first, count, count));
    }
  }
  out.data.noalias() = out.whitened_parts.transpose() * work.whitened;
  return true;
}

bool StrengthEvidence::profiles(const Projection& projection, const Variances& variances,
                                const PerPart<double>& floors, PerPart<StrengthProfile>& out,
                                Workspace& work) const {
  for (std::size_t part = 0; part < count_.size(); ++part) {
    if (count_[part] == 0) continue;
    const Eigen::Index first = first_root_[part], count = root_count_[part];
    work.gram = projection.parts.block(first, first, count, count);
    work.projected = projection.data.segment(first, count);
    if (!profile(variances[part], floors[part], out[part], work)) return false;
  }
  return true;
}

// With G G^T = I + delta C_gg and Y = G^-1 C_g: C - delta Y^T Y.
bool StrengthEvidence::changed_profiles(const Projection& projection, const Variances& variances,
                                        std::size_t part, double variance,
                                        const PerPart<double>& floors,
                                        PerPart<StrengthProfile>& out, Workspace& work) const {
  const Eigen::Index changed = first_root_[part], size = root_count_[part];
  const double delta = variance - variances[part];
  work.change.resize(size, roots_in_all_);
  const auto own = projection.parts.block(changed, changed, size, size);
  work.change.leftCols(changed) = projection.parts.block(changed, 0, size, changed);
  work.change.middleCols(changed, size) = own.selfadjointView<Eigen::Lower>();
  const Eigen::Index after = roots_in_all_ - changed - size;
  work.change.rightCols(after) =
      projection.parts.block(changed + size, changed, after, size).transpose();
  work.changed = projection.data.segment(changed, size);
  if (size > 0) {
    work.shifted.resize(size, size);
    work.shifted.triangularView<Eigen::Lower>() = delta * own;
    work.shifted.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(work.shifted);
    if (factor.info() != Eigen::Success) return false;
    blas::solve_lower(work.shifted, work.change);
    work.shifted.triangularView<Eigen::Lower>().solveInPlace(work.changed);
  }
  for (std::size_t each = 0; each < count_.size(); ++each) {
    if (count_[each] == 0) continue;
    const Eigen::Index first = first_root_[each], count = root_count_[each];
    work.gram = projection.parts.block(first, first, count, count);
    work.projected = projection.data.segment(first, count);
    if (count > 0 && size > 0) {
      const auto y = work.change.middleCols(first, count);
      work.gram.triangularView<Eigen::Lower>() -= delta * (y.transpose() * y);
      work.projected.noalias() -= delta * y.transpose() * work.changed;
    }
    const double own_variance = each == part ? variance : variances[each];
    if (!profile(own_variance, floors[each], out[each], work)) return false;
  }
  return true;
}

// In coordinates in which M is tridiagonal, so that a strength costs a pass over its diagonals.
bool StrengthEvidence::profile(double variance, double floor, StrengthProfile& out,
                               Workspace& work) {
  const Eigen::Index count = work.gram.rows();
  out.fill(0.0);
  if (count == 0) return true;
  for (linalg::GrowingVector* each : {&work.diagonal, &work.pivots}) each->resize(count);
  for (linalg::GrowingVector* each : {&work.beside, &work.factor}) each->resize(count - 1);
  blas::tridiagonalise(work.gram, work.projected, work.diagonal, work.beside, work.factor);
  // I + change M = F D F^T with F unit lower bidiagonal; 1/2 ln of its determinant in `log_root`.
  double log_root = 0.0;
  const auto shift = [&](double change) {
    for (Eigen::Index i = 0; i < count; ++i) {
      double pivot = 1.0 + change * work.diagonal[i];
      if (i > 0) {
        const double own = change * work.beside[i - 1];
        work.factor[i - 1] = own / work.pivots[i - 1];
        pivot -= own * work.factor[i - 1];
      }
      if (!(pivot > 0.0)) return false;
      work.pivots[i] = pivot;
    }
    log_root = 0.5 * work.pivots.array().log().sum();
    return std::isfinite(log_root);
  };
  const auto solve = [&](linalg::GrowingVector& v) {
    for (Eigen::Index i = 1; i < count; ++i) v[i] -= work.factor[i - 1] * v[i - 1];
    v.array() /= work.pivots.array();
    for (Eigen::Index i = count - 1; i > 0; --i) v[i - 1] -= work.factor[i - 1] * v[i];
  };
  work.start = work.projected;
  double without = 0.0;  // 1/2 ln |N|
  if (variance > 0.0) {
    if (!shift(-variance)) return false;
    without = log_root;
    solve(work.start);
  }
  for (std::size_t i = 0; i < kStrengths.size(); ++i) {
    const double t = kStrengths[i] * kStrengths[i] + floor;
    if (t == 0.0) continue;
    if (t == variance) {
      out[i] = without + 0.5 * t * work.projected.dot(work.start);
      continue;
    }
    if (!shift(t - variance)) return false;
    work.mean = work.start;
    solve(work.mean);
    out[i] = without - log_root + 0.5 * t * work.projected.dot(work.mean);
  }
  return true;
}

bool StrengthEvidence::mean(const Variances& variances, Workspace& work,
                            Eigen::Ref<VecX> out) const {
  if (!fill_omega(variances, work.omega)) return false;
  work.whitened = y_;
  work.omega.triangularView<Eigen::Lower>().solveInPlace(work.whitened);
  work.omega.triangularView<Eigen::Lower>().transpose().solveInPlace(work.whitened);
  // S^2 L Omega^-1 y
  out.noalias() = left_.topLeftCorner(size_, rank_) * work.whitened;
  if (common_variance_.cols() > 0) {
    out.head(common_).array() *= common_variance_.col(variances.error).array();
  }
  for (std::size_t part = 0; part < count_.size(); ++part) {
    out.segment(common_ + first_[part], count_[part]) *= variances[part];
  }
  return out.allFinite();
}

// K^-1 L_z^T S^2
bool StrengthEvidence::explained(const Variances& variances, Workspace& work,
                                 blas::Out<double> out) const {
  if (!fill_omega(variances, work.omega)) return false;
  out = left_.block(common_, 0, modes_, rank_).transpose();
  if (rank_ > 0) blas::solve_lower(work.omega, out);
  for (std::size_t part = 0; part < count_.size(); ++part) {
    out.middleCols(first_[part], count_[part]) *= variances[part];
  }
  return true;
}

}  // namespace brainshift::inversion
