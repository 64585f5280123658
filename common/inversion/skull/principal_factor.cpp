// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/principal_factor.hpp"

#include <algorithm>

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;

// With more changes than this part of the set (and this many), a new base costs less.
constexpr int kPart = 6;
constexpr Eigen::Index kFewChanges = 16;

}  // namespace

void list_active(const contact::ActiveSet& set, std::vector<int>& active) {
  active.clear();
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (set[i]) active.push_back(static_cast<int>(i));
  }
}

PrincipalFactor::PrincipalFactor(const double* matrix, int size, double shift, ThreadTeam& team)
    : matrix_(matrix),
      total_(size),
      shift_(shift),
      team_(team),
      row_in_base_(static_cast<std::size_t>(size), -1),
      row_in_set_(static_cast<std::size_t>(size), -1),
      factor_(new double[static_cast<std::size_t>(size) * static_cast<std::size_t>(size)]),
      cache_(new double[static_cast<std::size_t>(size) * kMaxChanges]),
      columns_(new double[static_cast<std::size_t>(size) * kMaxChanges]),
      schur_(kMaxChanges, kMaxChanges) {
  const auto all = static_cast<std::size_t>(size);
  for (std::vector<int>* each : {&active_, &base_, &changed_}) each->reserve(all);
  cached_.reserve(kMaxChanges);
  set_.reserve(all);
}

PrincipalFactor::Column PrincipalFactor::factor() const {
  return {factor_.get(), base_size(), base_size(), Eigen::OuterStride<>(base_size())};
}

PrincipalFactor::Column PrincipalFactor::columns(Eigen::Index first, Eigen::Index count) const {
  return {columns_.get() + first * total_, base_size(), count, Eigen::OuterStride<>(total_)};
}

bool PrincipalFactor::take(const contact::ActiveSet& set) {
  if (set == set_) return true;
  set_ = set;
  list_active(set, active_);
  std::fill(row_in_set_.begin(), row_in_set_.end(), -1);
  for (int j = 0; j < size(); ++j)
    row_in_set_[static_cast<std::size_t>(active_[static_cast<std::size_t>(j)])] = j;
  changed_.clear();
  for (const int member : active_) {
    if (row_in_base_[static_cast<std::size_t>(member)] < 0) changed_.push_back(member);
  }
  joining_ = changed_.size();
  for (const int member : base_) {
    if (row_in_set_[static_cast<std::size_t>(member)] < 0) changed_.push_back(member);
  }
  leaving_ = changed_.size() - joining_;
  if (changes() <= std::max(kFewChanges, base_size() / kPart) && gather_columns() &&
      factorise_changes()) {
    return true;
  }
  return make_base();
}

void PrincipalFactor::forget() {
  set_.clear();
  active_.clear();
  base_.clear();
  changed_.clear();
  cached_.clear();
  joining_ = leaving_ = 0;
  std::fill(row_in_base_.begin(), row_in_base_.end(), -1);
  std::fill(row_in_set_.begin(), row_in_set_.end(), -1);
}

bool PrincipalFactor::make_base() {
  base_ = active_;
  row_in_base_ = row_in_set_;
  changed_.clear();
  cached_.clear();
  joining_ = leaving_ = 0;
  if (base_.empty()) return true;
  auto d = factor();
  team_.split(base_size(), [&](long begin, long end) {
    for (Eigen::Index j = begin; j < end; ++j) {
      const double* own = column(base_[static_cast<std::size_t>(j)]);
      for (Eigen::Index i = j; i < base_size(); ++i) {
        d(i, j) = own[base_[static_cast<std::size_t>(i)]];
      }
      d(j, j) += shift_;
    }
  });
  if (linalg::cholesky(d, team_)) return true;
  forget();
  return false;
}

bool PrincipalFactor::gather_columns() {
  const Eigen::Index rows = base_size();
  const auto has = [](const std::vector<int>& all, int one) {
    return std::find(all.begin(), all.end(), one) != all.end();
  };
  const auto missing = static_cast<std::size_t>(
      std::count_if(changed_.begin(), changed_.end(), [&](int one) { return !has(cached_, one); }));
  if (cached_.size() + missing > kMaxChanges) {  // those that this set does not need make room
    std::size_t kept = 0;
    for (std::size_t j = 0; j < cached_.size(); ++j) {
      if (!has(changed_, cached_[j])) continue;
      if (kept < j) {
        std::copy_n(cache_.get() + static_cast<Eigen::Index>(j) * total_, rows,
                    cache_.get() + static_cast<Eigen::Index>(kept) * total_);
      }
      cached_[kept++] = cached_[j];
    }
    cached_.resize(kept);
    if (kept + missing > kMaxChanges) return false;
  }
  const std::size_t before = cached_.size();
  for (const int member : changed_) {
    if (has(cached_, member)) continue;
    double* made = cache_.get() + static_cast<Eigen::Index>(cached_.size()) * total_;
    const int own_row = row_in_base_[static_cast<std::size_t>(member)];
    if (own_row < 0) {
      gather(column(member), base_, made);
    } else {
      std::fill(made, made + rows, 0.0);
      made[own_row] = 1.0;
    }
    cached_.push_back(member);
  }
  if (rows > 0 && cached_.size() > before) {
    Column fresh(cache_.get() + static_cast<Eigen::Index>(before) * total_, rows,
                 static_cast<Eigen::Index>(cached_.size() - before), Eigen::OuterStride<>(total_));
    team_.split(fresh.cols(), [&](long begin, long end) {
      blas::solve_lower(factor(), fresh.middleCols(begin, end - begin));
    });
  }
  for (std::size_t j = 0; j < changed_.size(); ++j) {
    const auto place = std::find(cached_.begin(), cached_.end(), changed_[j]) - cached_.begin();
    std::copy_n(cache_.get() + place * total_, rows,
                columns_.get() + static_cast<Eigen::Index>(j) * total_);
  }
  return true;
}

// C = D_aa - V_a^T V_a = G G^T, Z = -G^-1 V_a^T V_q, N N^T = V_q^T V_q + Z^T Z.
bool PrincipalFactor::factorise_changes() {
  const auto a = static_cast<Eigen::Index>(joining_), q = static_cast<Eigen::Index>(leaving_);
  if (a + q == 0) return true;
  auto all = schur_.topLeftCorner(a + q, a + q);
  all.setZero();
  if (base_size() > 0) blas::gram(columns(0, a + q), 0.0, all);
  auto joining = all.topLeftCorner(a, a);
  for (Eigen::Index j = 0; j < a; ++j) {
    for (Eigen::Index i = j; i < a; ++i) {
      joining(i, j) =
          entry(changed_[static_cast<std::size_t>(i)], changed_[static_cast<std::size_t>(j)]) -
          joining(i, j);
    }
  }
  if (a > 0 && !blas::cholesky(joining)) return false;
  if (q == 0) return true;
  // Z in the upper right corner, which nothing else uses.
  auto z = all.topRightCorner(a, q);
  auto leaving = all.bottomRightCorner(q, q);
  if (a > 0) {
    z = -all.bottomLeftCorner(q, a).transpose();
    blas::solve_lower(joining, z);
    blas::gram(z, 1.0, leaving);
  }
  return blas::cholesky(leaving);
}

void PrincipalFactor::solve(blas::Out<double> b, blas::Out<double> work) const {
  const Eigen::Index rows = base_size(), columns_of_b = b.cols();
  const auto a = static_cast<Eigen::Index>(joining_), q = static_cast<Eigen::Index>(leaving_);
  if (b.rows() == 0) return;
  if (a + q == 0) {
    blas::solve_lower(factor(), b);
    blas::solve_lower_transposed(factor(), b);
    return;
  }
  auto x = work.topRows(rows);
  auto t = work.middleRows(rows, a + q);
  const auto row_of = [&](int member) { return row_in_set_[static_cast<std::size_t>(member)]; };
  for (Eigen::Index c = 0; c < columns_of_b; ++c) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      const int row = row_of(base_[static_cast<std::size_t>(i)]);
      x(i, c) = row >= 0 ? b(row, c) : 0.0;
    }
    for (Eigen::Index i = 0; i < a; ++i) {
      t(i, c) = b(row_of(changed_[static_cast<std::size_t>(i)]), c);
    }
    for (Eigen::Index i = a; i < a + q; ++i) t(i, c) = 0.0;
  }
  if (rows > 0) {
    blas::solve_lower(factor(), x);
    blas::multiply_transposed(-1.0, columns(0, a + q), x, 1.0, t);
  }
  // [C Y; Y^T -V_q^T V_q], Y = -V_a^T V_q
  auto joining = t.topRows(a), leaving = t.bottomRows(q);
  const auto g = schur_.topLeftCorner(a, a);
  const auto z = schur_.block(0, a, a, q);
  const auto n = schur_.block(a, a, q, q);
  if (a > 0) blas::solve_lower(g, joining);
  if (q > 0) {
    if (a > 0) blas::multiply_transposed(-1.0, z, joining, 1.0, leaving);
    blas::solve_lower(n, leaving);
    blas::solve_lower_transposed(n, leaving);
    leaving *= -1.0;
    if (a > 0) blas::multiply(-1.0, z, leaving, 1.0, joining);
  }
  if (a > 0) blas::solve_lower_transposed(g, joining);
  if (rows > 0) {
    blas::multiply(-1.0, columns(0, a + q), t, 1.0, x);
    blas::solve_lower_transposed(factor(), x);
  }
  for (Eigen::Index c = 0; c < columns_of_b; ++c) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      const int row = row_of(base_[static_cast<std::size_t>(i)]);
      if (row >= 0) b(row, c) = x(i, c);
    }
    for (Eigen::Index i = 0; i < a; ++i) {
      b(row_of(changed_[static_cast<std::size_t>(i)]), c) = t(i, c);
    }
  }
}

}  // namespace brainshift::inversion
