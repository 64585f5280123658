// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/cholesky.hpp"

#include <cholmod.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <mutex>
#include <numeric>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::linalg {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// The dense columns of one supernode: `corner`, lower triangular, of its own unknowns, and `below`
// of the rows `row` further down.
struct Supernode {
  Index first, width, rest;
  const long* row;
  Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>> corner, below;

  // widths: so many columns of each supernode; empty: all.
  Supernode(const SupernodalView& l, std::size_t s, std::span<const long> widths)
      : first(l.first[s]),
        width(widths.empty() ? l.first[s + 1] - first : widths[s]),
        rest(l.rows[s + 1] - l.rows[s] - width),
        row(l.row_of + l.rows[s] + width),
        corner(l.values + l.at[s], width, width, Eigen::OuterStride<>(width + rest)),
        below(l.values + l.at[s] + width, rest, width, Eigen::OuterStride<>(width + rest)) {}
};

// X L^-T
void forward(const SupernodalView& l, MatrixXd& x, MatrixXd& scratch,
             std::span<const long> widths = {}) {
  for (std::size_t s = 0; s + 1 < l.first.size(); ++s) {
    const Supernode node(l, s, widths);
    auto own = x.middleCols(node.first, node.width);
    if ((own.array() == 0.0).all()) continue;
    blas::solve_lower_transposed_right(node.corner, own);
    if (node.rest == 0) continue;
    auto change = scratch.leftCols(node.rest);
    blas::multiply_by_transposed(1.0, own, node.below, 0.0, change);
    for (Index i = 0; i < node.rest; ++i) x.col(node.row[i]) -= change.col(i);
  }
}

// X L^-1
void backward(const SupernodalView& l, MatrixXd& x, MatrixXd& scratch,
              std::span<const long> widths = {}) {
  for (std::size_t s = l.first.size() - 1; s-- > 0;) {
    const Supernode node(l, s, widths);
    if (node.width == 0) continue;
    auto own = x.middleCols(node.first, node.width);
    if (node.rest > 0) {
      auto others = scratch.leftCols(node.rest);
      for (Index i = 0; i < node.rest; ++i) others.col(i) = x.col(node.row[i]);
      blas::multiply(-1.0, others, node.below, 1.0, own);
    }
    blas::solve_lower_right(node.corner, own);
  }
}

void make_room(const SupernodalView& l, Index fields, MatrixXd& scratch,
               std::span<const long> widths = {}) {
  Index most = 0;
  for (std::size_t s = 0; s + 1 < l.first.size(); ++s) {
    most = std::max(most, Supernode(l, s, widths).rest);
  }
  if (scratch.rows() != fields || scratch.cols() < most) scratch.resize(fields, most);
}

}  // namespace

void substitute(const SupernodalView& l, MatrixXd& x, MatrixXd& scratch) {
  make_room(l, x.rows(), scratch);
  forward(l, x, scratch);
  backward(l, x, scratch);
}

namespace {

// A CHOLMOD view of Eigen's arrays; nothing is copied.
cholmod_sparse view_of(const SymmetricMatrix& lower) {
  cholmod_sparse view{};
  view.nrow = static_cast<std::size_t>(lower.rows());
  view.ncol = static_cast<std::size_t>(lower.cols());
  view.nzmax = static_cast<std::size_t>(lower.nonZeros());
  view.p = const_cast<long*>(lower.outerIndexPtr());
  view.i = const_cast<long*>(lower.innerIndexPtr());
  view.x = const_cast<double*>(lower.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_LONG;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

cholmod_dense view_of(const double* data, std::size_t rows, std::size_t columns) {
  cholmod_dense view{};
  view.nrow = rows;
  view.ncol = columns;
  view.nzmax = rows * columns;
  view.d = rows;
  view.x = const_cast<double*>(data);
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  return view;
}

SupernodalView view_of(const cholmod_factor& factor) {
  const auto list = [&](const void* data) {
    return std::span(static_cast<const long*>(data), factor.nsuper + 1);
  };
  return {list(factor.super), list(factor.pi), list(factor.px), static_cast<const long*>(factor.s),
          static_cast<const double*>(factor.x)};
}

// Smallest ratio of a pivot L_jj^2 to the diagonal K_jj: what elimination has cancelled. Rounding
// leaves a pivot wrong by some 1e-14 K_jj (`make stability`, weak support: 85 unit roundoffs), so
// with a ratio below this its error is more than a thousandth. Unlike the reciprocal condition
// this ratio does not depend on units: stiff contact springs do not lower it.
constexpr double kMinPivotShare = 1e-11;

double least_pivot_share(const cholmod_factor& factor, const SymmetricMatrix& lower) {
  const SupernodalView view = view_of(factor);
  const auto* order = static_cast<const long*>(factor.Perm);
  double least = 1.0;
  for (std::size_t s = 0; s < factor.nsuper; ++s) {
    const long stride = view.rows[s + 1] - view.rows[s] + 1;  // down the diagonal of the supernode
    for (long k = view.first[s]; k < view.first[s + 1]; ++k) {
      const double l = view.values[view.at[s] + (k - view.first[s]) * stride];
      const double diagonal = lower.valuePtr()[lower.outerIndexPtr()[order[k]]];
      least = std::min(least, l * l / diagonal);
    }
  }
  return least;
}

// CHOLMOD reads the lower triangle and silently drops entries above it.
Status check_symmetric(const SymmetricMatrix& lower) {
  for (long j = 0; j < lower.outerSize(); ++j) {
    const long first = lower.outerIndexPtr()[j];
    if (first == lower.outerIndexPtr()[j + 1] || lower.innerIndexPtr()[first] == j) continue;
    return invalid(
        fmt::format("stiffness matrix: column {} starts at row {}; a symmetric matrix is given by "
                    "its lower triangle, diagonal included",
                    j, lower.innerIndexPtr()[first]));
  }
  return {};
}

Status check_finite(const SymmetricMatrix& lower) {
  for (long k = 0; k < lower.nonZeros(); ++k) {
    if (!std::isfinite(lower.valuePtr()[k])) {
      return fail(ErrorCode::kNotFinite, "stiffness matrix: entry " + std::to_string(k) +
                                             " of the lower triangle is not finite");
    }
  }
  return {};
}

}  // namespace

// Solution and workspace of solves, kept so that the hot path does not allocate.
struct SparseCholesky::Workspace::Impl {
  cholmod_common common{};
  cholmod_dense* x = nullptr;
  cholmod_dense* y = nullptr;
  cholmod_dense* e = nullptr;
  Eigen::MatrixXd block, scratch;  // of substitute()

  Impl() {
    cholmod_l_start(&common);
    common.print = 0;
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    cholmod_l_free_dense(&x, &common);
    cholmod_l_free_dense(&y, &common);
    cholmod_l_free_dense(&e, &common);
    cholmod_l_finish(&common);
  }
  // The solution, valid until the next call.
  const double* solve(cholmod_factor* factor, const VecX& b) {
    cholmod_dense rhs = view_of(b.data(), static_cast<std::size_t>(b.size()), 1);
    const int ok = cholmod_l_solve2(CHOLMOD_A, factor, &rhs, nullptr, &x, nullptr, &y, &e, &common);
    assert(ok);
    (void)ok;
    return static_cast<const double*>(x->x);
  }
};

SparseCholesky::Workspace::Workspace() : impl_(std::make_unique<Impl>()) {}
SparseCholesky::Workspace::Workspace(Workspace&&) noexcept = default;
SparseCholesky::Workspace& SparseCholesky::Workspace::operator=(Workspace&&) noexcept = default;
SparseCholesky::Workspace::~Workspace() = default;

struct SparseCholesky::Impl {
  mutable cholmod_common common{};
  cholmod_factor* factor = nullptr;
  mutable Workspace::Impl workspace;  // for solves without a workspace of their own
  std::uint64_t nonzeros = 0;
  double rcond = 0.0, analyse_s = 0.0, factor_s = 0.0;
  long kept = 0;
  std::vector<long> widths;  // of each supernode, the columns of unknowns that are not kept

  bool is_kept(long place) const {
    return static_cast<const long*>(factor->Perm)[place] >= static_cast<long>(factor->n) - kept;
  }
  // The kept unknowns' columns reach kept ones only, so they are the last of their supernode.
  void split_supernodes() {
    const SupernodalView view = view_of(*factor);
    for (std::size_t s = 0; s < factor->nsuper; ++s) {
      long width = 0;
      while (view.first[s] + width < view.first[s + 1] && !is_kept(view.first[s] + width)) ++width;
      widths.push_back(width);
    }
  }
  // Nested dissection of the others, then those that are kept.
  cholmod_factor* analyse(const SymmetricMatrix& lower) {
    cholmod_sparse view = view_of(lower);
    if (kept == 0) return cholmod_l_analyze(&view, &common);
    std::vector<long> order(view.nrow);
    std::iota(order.begin(), order.end(), 0L);
    const long others = static_cast<long>(view.nrow) - kept;
    const SymmetricMatrix inner = lower.topLeftCorner(others, others);
    cholmod_sparse inner_view = view_of(inner);
    if (others > 0 && !cholmod_l_metis(&inner_view, nullptr, 0, 1, order.data(), &common)) {
      return nullptr;
    }
    common.method[0].ordering = CHOLMOD_GIVEN;
    return cholmod_l_analyze_p(&view, order.data(), nullptr, 0, &common);
  }

  Impl() {
    cholmod_l_start(&common);
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
    common.postorder = 1;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.print = 0;
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_finish(&common);
  }
};

SparseCholesky::SparseCholesky(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

Result<SparseCholesky> SparseCholesky::factorise(const SymmetricMatrix& lower, int kept) {
  if (lower.rows() == 0) {
    return fail(ErrorCode::kEmptySet, "stiffness matrix: no unknown is left to solve for");
  }
  if (auto symmetric = check_symmetric(lower); !symmetric) return tl::unexpected(symmetric.error());
  if (auto finite = check_finite(lower); !finite) return tl::unexpected(finite.error());
  use_single_threaded_blas();
  SparseCholesky cholesky(std::make_unique<Impl>());
  Impl& impl = *cholesky.impl_;
  impl.kept = kept;
  const Stopwatch watch;
  {
    // METIS draws from rand(): two analyses at once would give other orderings than one by one.
    static std::mutex one_at_a_time;
    const std::lock_guard lock(one_at_a_time);
    impl.factor = impl.analyse(lower);
  }
  impl.analyse_s = watch.seconds();
  impl.nonzeros = static_cast<std::uint64_t>(impl.common.lnz);
  if (impl.factor == nullptr) {
    return fail(ErrorCode::kSingularMatrix,
                "stiffness matrix: symbolic analysis failed (CHOLMOD status " +
                    std::to_string(impl.common.status) + ")");
  }
  if (auto status = cholesky.refactorise(lower); !status) return tl::unexpected(status.error());
  if (kept > 0) impl.split_supernodes();
  return cholesky;
}

Status SparseCholesky::refactorise(const SymmetricMatrix& lower) {
  assert(static_cast<std::size_t>(lower.rows()) == impl_->factor->n);
  if (auto finite = check_finite(lower); !finite) return finite;
  const Stopwatch watch;
  cholmod_sparse view = view_of(lower);
  const int ok = cholmod_l_factorize(&view, impl_->factor, &impl_->common);
  impl_->factor_s = watch.seconds();
  if (!ok || impl_->common.status < CHOLMOD_OK) {
    return fail(ErrorCode::kSingularMatrix,
                "stiffness matrix: factorisation failed (CHOLMOD status " +
                    std::to_string(impl_->common.status) + ")");
  }
  const std::string advice =
      "; the body is not held (too few fixed nodes) or an element is degenerate";
  if (impl_->factor->minor != impl_->factor->n) {
    return fail(ErrorCode::kFloatingBody, "stiffness matrix: not positive definite at unknown " +
                                              std::to_string(impl_->factor->minor) + advice);
  }
  impl_->rcond = cholmod_l_rcond(impl_->factor, &impl_->common);
  if (!(impl_->rcond >= kMinRcond)) {
    return fail(ErrorCode::kFloatingBody,
                fmt::format("stiffness matrix: reciprocal condition {:g} is below {:g}{}",
                            impl_->rcond, kMinRcond, advice));
  }
  const double share = least_pivot_share(*impl_->factor, lower);
  if (!(share >= kMinPivotShare)) {
    return fail(ErrorCode::kFloatingBody,
                fmt::format("stiffness matrix: elimination leaves {:g} of a diagonal entry, below "
                            "{:g}{}",
                            share, kMinPivotShare, advice));
  }
  return {};
}

SparseCholesky SparseCholesky::clone_analysis() const {
  SparseCholesky copy(std::make_unique<Impl>());
  copy.impl_->analyse_s = impl_->analyse_s;
  copy.impl_->nonzeros = impl_->nonzeros;
  copy.impl_->factor = cholmod_l_copy_factor(impl_->factor, &copy.impl_->common);
  assert(copy.impl_->factor != nullptr);
  // Back to symbolic: values of the original are dropped, ordering and supernodes stay.
  cholmod_l_change_factor(CHOLMOD_PATTERN, 1, 1, 1, 1, copy.impl_->factor, &copy.impl_->common);
  return copy;
}

void SparseCholesky::solve(const VecX& b, VecX& x) const {
  assert(b.size() == size());
  x = Eigen::Map<const VecX>(impl_->workspace.solve(impl_->factor, b), b.size());
}

VecX SparseCholesky::solve(const VecX& b) const {
  VecX x;
  solve(b, x);
  return x;
}

void SparseCholesky::solve_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& x,
                                Workspace& workspace) const {
  assert(b.cols() == size());
  const cholmod_factor& factor = *impl_->factor;
  const Eigen::Map<const Eigen::Matrix<long, Eigen::Dynamic, 1>> order(
      static_cast<const long*>(factor.Perm), b.cols());
  Eigen::MatrixXd& block = workspace.impl_->block;
  block.resize(b.rows(), b.cols());
  for (Eigen::Index i = 0; i < b.cols(); ++i) block.col(i) = b.col(order[i]);
  substitute(view_of(factor), block, workspace.impl_->scratch);
  x.resize(b.rows(), b.cols());
  for (Eigen::Index i = 0; i < b.cols(); ++i) x.col(order[i]) = block.col(i);
}

Eigen::MatrixXd SparseCholesky::solve_rows(const Eigen::MatrixXd& b) const {
  Workspace workspace;
  Eigen::MatrixXd x;
  solve_rows(b, x, workspace);
  return x;
}

void SparseCholesky::reduce_rows(const MatrixXd& b, MatrixXd& g, Workspace& workspace) const {
  const auto* order = static_cast<const long*>(impl_->factor->Perm);
  MatrixXd& block = workspace.impl_->block;
  block.resize(b.rows(), size());
  for (Index i = 0; i < size(); ++i) {
    if (order[i] < b.cols()) {
      block.col(i) = b.col(order[i]);
    } else {
      block.col(i).setZero();
    }
  }
  const SupernodalView view = view_of(*impl_->factor);
  make_room(view, b.rows(), workspace.impl_->scratch, impl_->widths);
  forward(view, block, workspace.impl_->scratch, impl_->widths);
  g.resize(b.rows(), impl_->kept);
  for (Index i = 0; i < size(); ++i) {
    if (order[i] >= b.cols()) g.col(order[i] - b.cols()) = block.col(i);
  }
}

void SparseCholesky::finish_rows(const MatrixXd& kept, MatrixXd& x, Workspace& workspace) const {
  const auto* order = static_cast<const long*>(impl_->factor->Perm);
  MatrixXd& block = workspace.impl_->block;
  const Index others = size() - impl_->kept;
  for (Index i = 0; i < size(); ++i) {
    if (order[i] >= others) block.col(i) = kept.col(order[i] - others);
  }
  backward(view_of(*impl_->factor), block, workspace.impl_->scratch, impl_->widths);
  x.resize(block.rows(), others);
  for (Index i = 0; i < size(); ++i) {
    if (order[i] < others) x.col(order[i]) = block.col(i);
  }
}

// L_bb L_bb^T, since nothing else of L is in these rows and columns once the others are eliminated.
MatrixXd SparseCholesky::schur_complement() const {
  const SupernodalView view = view_of(*impl_->factor);
  const auto* order = static_cast<const long*>(impl_->factor->Perm);
  const long others = size() - impl_->kept;
  MatrixXd factor = MatrixXd::Zero(impl_->kept, impl_->kept);
  for (std::size_t s = 0; s < impl_->widths.size(); ++s) {
    const long rows = view.rows[s + 1] - view.rows[s];
    for (long j = impl_->widths[s]; j < view.first[s + 1] - view.first[s]; ++j) {
      for (long i = j; i < rows; ++i) {
        factor(order[view.row_of[view.rows[s] + i]] - others, order[view.first[s] + j] - others) =
            view.values[view.at[s] + j * rows + i];
      }
    }
  }
  MatrixXd complement = MatrixXd::Zero(impl_->kept, impl_->kept);
  blas::subtract_outer(factor, complement);
  complement *= -1.0;
  return complement;
}

void SparseCholesky::drop_kept() {
  cholmod_factor& factor = *impl_->factor;
  std::size_t used = impl_->widths.size();
  while (used > 0 && impl_->widths[used - 1] == 0) --used;
  const auto numbers = static_cast<std::size_t>(view_of(factor).at[used]);
  factor.x = cholmod_l_realloc(numbers, sizeof(double), factor.x, &factor.xsize, &impl_->common);
}

int SparseCholesky::size() const { return static_cast<int>(impl_->factor->n); }
double SparseCholesky::rcond() const { return impl_->rcond; }
std::uint64_t SparseCholesky::nonzeros() const { return impl_->nonzeros; }
std::uint64_t SparseCholesky::bytes() const {
  // Supernodes store explicit zeros, so this exceeds 8 bytes per nonzero.
  return static_cast<std::uint64_t>(impl_->factor->xsize) * sizeof(double) +
         static_cast<std::uint64_t>(impl_->factor->ssize) * sizeof(long);
}
double SparseCholesky::analyse_seconds() const { return impl_->analyse_s; }
double SparseCholesky::factor_seconds() const { return impl_->factor_s; }

}  // namespace brainshift::linalg
