// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/symmetric_indefinite.hpp"

#include <cholmod.h>
#include <dmumps_c.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/random.hpp"
#include "common/core/stopwatch.hpp"
#include "common/linalg/checked_solve.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::linalg {
namespace {

constexpr int kBlock = 64;      // right-hand sides that MUMPS works on at once
constexpr int kMaxRefined = 2;  // steps of iterative refinement
// Quasi-definite matrices have an L D L^T in any order. The swaps that MUMPS makes with its usual
// threshold cost no measurable time and keep extreme steps accurate.
constexpr double kPivotThreshold = 0.01;
constexpr std::uint64_t kProbeSeed = 17;

// MUMPS is not reentrant (module variables), not even for different instances.
std::mutex& mumps_mutex() {
  static std::mutex mutex;
  return mutex;
}

Status check_finite_lower(const SymmetricMatrix& lower) {
  for (long k = 0; k < lower.nonZeros(); ++k) {
    if (!std::isfinite(lower.valuePtr()[k])) {
      return fail(ErrorCode::kNotFinite, "consolidation matrix: entry " + std::to_string(k) +
                                             " of the lower triangle is not finite");
    }
  }
  return {};
}

// Position in the elimination order of each unknown, 1-based: nested dissection by the METIS in
// CHOLMOD. MUMPS itself has SCOTCH, PORD and AMD; docs/decisions/0011.
std::vector<int> nested_dissection(const SymmetricMatrix& lower) {
  cholmod_common common{};
  cholmod_l_start(&common);
  common.print = 0;
  cholmod_sparse view{};
  view.nrow = view.ncol = static_cast<std::size_t>(lower.rows());
  view.nzmax = static_cast<std::size_t>(lower.nonZeros());
  view.p = const_cast<long*>(lower.outerIndexPtr());
  view.i = const_cast<long*>(lower.innerIndexPtr());
  view.stype = -1;
  view.itype = CHOLMOD_LONG;
  view.xtype = CHOLMOD_PATTERN;
  view.sorted = 1;
  view.packed = 1;
  std::vector<long> order(view.nrow);
  const int ok = cholmod_l_metis(&view, nullptr, 0, 1, order.data(), &common);
  cholmod_l_finish(&common);
  if (!ok) return {};
  std::vector<int> position(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    position[static_cast<std::size_t>(order[k])] = static_cast<int>(k) + 1;
  }
  return position;
}

}  // namespace

struct SymmetricIndefinite::Impl {
  mutable DMUMPS_STRUC_C mumps{};
  bool started = false;
  int negative_pivots = 0;
  SymmetricMatrix scaled;          // S A S, lower
  VecX scale;                      // S
  std::vector<int> position;       // of every unknown in the elimination order
  std::vector<int> rows, columns;  // of the entries, 1-based
  double norm = 0.0;               // largest absolute row sum of S A S
  double rcond = 0.0, analyse_s = 0.0, factor_s = 0.0;
  mutable SolveCheck last;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (started) call(-2);
  }

  int call(int job) const {
    const std::lock_guard lock(mumps_mutex());
    mumps.job = job;
    dmumps_c(&mumps);
    return mumps.infog[0];
  }
  Status analyse(const SymmetricMatrix& lower);
  void rescale(const SymmetricMatrix& lower);
  void raw_solve(double* columns_in_out, int count) const;
  double backward_error(const VecX& b, const VecX& x, VecX& residual) const;
  double estimate_rcond() const;
  Status refine(const VecX& b, VecX& x, SolveCheck& check) const;
  void keep(const SolveCheck& latest) const {
    const std::lock_guard lock(mumps_mutex());
    last = latest;
  }
};

// Pattern, ordering and symbolic factorisation.
Status SymmetricIndefinite::Impl::analyse(const SymmetricMatrix& lower) {
  const Stopwatch watch;
  const auto entries = static_cast<std::size_t>(lower.nonZeros());
  rows.resize(entries);
  columns.resize(entries);
  for (long j = 0; j < lower.outerSize(); ++j) {
    for (long k = lower.outerIndexPtr()[j]; k < lower.outerIndexPtr()[j + 1]; ++k) {
      rows[static_cast<std::size_t>(k)] = static_cast<int>(lower.innerIndexPtr()[k]) + 1;
      columns[static_cast<std::size_t>(k)] = static_cast<int>(j) + 1;
    }
  }
  if (position.empty()) position = nested_dissection(lower);
  mumps.sym = 2;
  mumps.par = 1;
  mumps.comm_fortran = -987654;  // the communicator of the sequential library
  call(-1);
  started = true;
  for (int k = 0; k < 3; ++k) mumps.icntl[k] = 0;  // no output
  mumps.icntl[3] = 0;
  mumps.icntl[5] = 0;                         // values play no part in the analysis
  mumps.icntl[6] = position.empty() ? 7 : 1;  // given ordering
  mumps.icntl[7] = 0;                         // scaled here
  mumps.icntl[11] = 1;
  mumps.icntl[12] = 1;   // exact inertia
  mumps.icntl[13] = 30;  // percent of memory beyond the estimate
  mumps.icntl[15] = 1;   // one thread
  mumps.icntl[26] = kBlock;
  mumps.cntl[0] = kPivotThreshold;
  mumps.n = static_cast<int>(lower.rows());
  mumps.nnz = lower.nonZeros();
  mumps.irn = rows.data();
  mumps.jcn = columns.data();
  mumps.perm_in = position.empty() ? nullptr : position.data();
  const int status = call(1);
  analyse_s = watch.seconds();
  if (status < 0) {
    return fail(ErrorCode::kSingularMatrix,
                "consolidation matrix: symbolic analysis failed (MUMPS status " +
                    std::to_string(status) + ")");
  }
  return {};
}

// S = |diag A|^-1/2, or the largest entry of the row where the diagonal is zero.
void SymmetricIndefinite::Impl::rescale(const SymmetricMatrix& lower) {
  VecX largest = VecX::Zero(lower.rows());
  VecX diagonal = VecX::Zero(lower.rows());
  for (long j = 0; j < lower.outerSize(); ++j) {
    for (SymmetricMatrix::InnerIterator it(lower, j); it; ++it) {
      const double size = std::abs(it.value());
      largest[it.row()] = std::max(largest[it.row()], size);
      largest[j] = std::max(largest[j], size);
      if (it.row() == j) diagonal[j] = size;
    }
  }
  scale.resize(lower.rows());
  for (Eigen::Index i = 0; i < scale.size(); ++i) {
    const double size = diagonal[i] > 0.0 ? diagonal[i] : largest[i];
    scale[i] = size > 0.0 ? 1.0 / std::sqrt(size) : 1.0;
  }
  scaled = lower;
  for (long j = 0; j < scaled.outerSize(); ++j) {
    for (SymmetricMatrix::InnerIterator it(scaled, j); it; ++it) {
      it.valueRef() *= scale[it.row()] * scale[j];
    }
  }
  norm = max_norm(scaled);
}

void SymmetricIndefinite::Impl::raw_solve(double* columns_in_out, int count) const {
  const std::lock_guard lock(mumps_mutex());
  mumps.rhs = columns_in_out;
  mumps.nrhs = count;
  mumps.lrhs = mumps.n;
  mumps.job = 3;
  dmumps_c(&mumps);
  mumps.rhs = nullptr;
  if (mumps.infog[0] < 0) {  // out of memory; told apart by the finite check of the caller
    std::fill_n(columns_in_out, static_cast<std::size_t>(mumps.n) * count,
                std::numeric_limits<double>::quiet_NaN());
  }
}

double SymmetricIndefinite::Impl::backward_error(const VecX& b, const VecX& x,
                                                 VecX& residual) const {
  const double error = linalg::backward_error(scaled, norm, b, x, residual);
  residual = b - residual;
  return error;
}

// 1 / (|A| |A^-1|), the second norm by Hager's ascent: a lower bound that is rarely off by more
// than three. Its last vector is Higham's (1988, ACM TOMS 14:381), for matrices whose symmetry
// keeps the ascent where it started.
double SymmetricIndefinite::Impl::estimate_rcond() const {
  const Eigen::Index n = scale.size();
  VecX x = VecX::Constant(n, 1.0 / static_cast<double>(n));
  double inverse_norm = 0.0;
  for (int round = 0; round < 4; ++round) {
    VecX y = x;
    raw_solve(y.data(), 1);
    if (!y.allFinite()) return 0.0;
    inverse_norm = std::max(inverse_norm, y.lpNorm<1>());
    VecX z = y.unaryExpr([](double v) { return v < 0.0 ? -1.0 : 1.0; });
    raw_solve(z.data(), 1);
    if (!z.allFinite()) return 0.0;
    Eigen::Index steepest = 0;
    const double slope = z.cwiseAbs().maxCoeff(&steepest);
    if (slope <= z.dot(x)) break;
    x = VecX::Unit(n, steepest);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const double size =
        1.0 + static_cast<double>(i) / static_cast<double>(std::max<Eigen::Index>(1, n - 1));
    x[i] = i % 2 == 0 ? size : -size;
  }
  raw_solve(x.data(), 1);
  if (!x.allFinite()) return 0.0;
  inverse_norm = std::max(inverse_norm, 2.0 * x.lpNorm<1>() / (3.0 * static_cast<double>(n)));
  return inverse_norm > 0.0 ? 1.0 / (norm * inverse_norm) : 0.0;
}

// Refines x, a solution of A x = b up to rounding, or returns an error with its backward error.
Status SymmetricIndefinite::Impl::refine(const VecX& b, VecX& x, SolveCheck& check) const {
  VecX residual;
  check = {backward_error(b, x, residual), 0};
  while (check.backward_error > kMaxBackwardError && check.refinements < kMaxRefined) {
    raw_solve(residual.data(), 1);
    x += residual;
    check.backward_error = backward_error(b, x, residual);
    ++check.refinements;
  }
  if (!std::isfinite(check.backward_error) || !x.allFinite()) {
    return fail(ErrorCode::kNotFinite, "consolidation solve: the solution is not finite");
  }
  if (check.backward_error > kMaxBackwardError) {
    return fail(
        ErrorCode::kNotConverged,
        fmt::format("consolidation solve: backward error {:g} after {} refinements is above {:g}",
                    check.backward_error, check.refinements, kMaxBackwardError));
  }
  return {};
}

SymmetricIndefinite::SymmetricIndefinite(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SymmetricIndefinite::SymmetricIndefinite(SymmetricIndefinite&&) noexcept = default;
SymmetricIndefinite& SymmetricIndefinite::operator=(SymmetricIndefinite&&) noexcept = default;
SymmetricIndefinite::~SymmetricIndefinite() = default;

Result<SymmetricIndefinite> SymmetricIndefinite::factorise(const SymmetricMatrix& lower,
                                                           int negative_pivots) {
  if (lower.rows() == 0) {
    return fail(ErrorCode::kEmptySet, "consolidation matrix: no unknown is left to solve for");
  }
  if (auto finite = check_finite_lower(lower); !finite) return tl::unexpected(finite.error());
  use_single_threaded_blas();
  SymmetricIndefinite factor(std::make_unique<Impl>());
  factor.impl_->negative_pivots = negative_pivots;
  if (auto ok = factor.impl_->analyse(lower); !ok) return tl::unexpected(ok.error());
  if (auto ok = factor.refactorise(lower); !ok) return tl::unexpected(ok.error());
  return factor;
}

Status SymmetricIndefinite::refactorise(const SymmetricMatrix& lower) {
  Impl& impl = *impl_;
  assert(lower.rows() == impl.mumps.n && lower.nonZeros() == impl.mumps.nnz);
  if (auto finite = check_finite_lower(lower); !finite) return finite;
  const Stopwatch watch;
  impl.rescale(lower);
  impl.mumps.a = impl.scaled.valuePtr();
  int status = impl.call(2);
  // Delayed pivots need room that the analysis did not foresee.
  while ((status == -8 || status == -9) && impl.mumps.icntl[13] < 1000) {
    impl.mumps.icntl[13] *= 3;
    status = impl.call(2);
  }
  const std::string advice =
      "; the body is not held (too few fixed nodes), fluid is enclosed that nothing can take up, "
      "or an element is degenerate";
  if (status == -10) {
    return fail(ErrorCode::kFloatingBody, "consolidation matrix: a pivot vanished" + advice);
  }
  if (status < 0) {
    return fail(
        ErrorCode::kSingularMatrix,
        "consolidation matrix: factorisation failed (MUMPS status " + std::to_string(status) + ")");
  }
  if (impl.mumps.infog[11] != impl.negative_pivots) {
    return fail(ErrorCode::kFloatingBody,
                "consolidation matrix: " + std::to_string(impl.mumps.infog[11]) +
                    " negative pivots instead of " + std::to_string(impl.negative_pivots) +
                    " (the pressure unknowns)" + advice);
  }
  impl.rcond = impl.estimate_rcond();
  impl.factor_s = watch.seconds();
  if (!(impl.rcond >= kMinRcond)) {
    return fail(ErrorCode::kFloatingBody,
                fmt::format("consolidation matrix: reciprocal condition {:g} is below {:g}{}",
                            impl.rcond, kMinRcond, advice));
  }
  return {};
}

SymmetricIndefinite SymmetricIndefinite::clone_analysis() const {
  SymmetricIndefinite copy(std::make_unique<Impl>());
  copy.impl_->negative_pivots = impl_->negative_pivots;
  copy.impl_->position = impl_->position;
  // MUMPS cannot copy an analysis; with the ordering known it takes a fraction of the first one.
  const auto ok = copy.impl_->analyse(impl_->scaled);
  assert(ok.has_value());
  (void)ok;
  return copy;
}

Status SymmetricIndefinite::solve(const VecX& b, VecX& x) const {
  assert(b.size() == size());
  if (!b.allFinite()) {
    return fail(ErrorCode::kNotFinite, "consolidation solve: the load is not finite");
  }
  const VecX scaled_b = impl_->scale.cwiseProduct(b);
  x = scaled_b;
  impl_->raw_solve(x.data(), 1);
  SolveCheck check;
  Status refined = impl_->refine(scaled_b, x, check);
  impl_->keep(check);
  if (!refined) return refined;
  x = x.cwiseProduct(impl_->scale).eval();
  return {};
}

Status SymmetricIndefinite::solve_many(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) const {
  assert(b.rows() == size());
  if (!b.allFinite()) {
    return fail(ErrorCode::kNotFinite, "consolidation solve: a load is not finite");
  }
  if (b.cols() == 0) {
    x.resize(b.rows(), 0);
    return {};
  }
  const Eigen::MatrixXd scaled_b = impl_->scale.asDiagonal() * b;
  x = scaled_b;
  impl_->raw_solve(x.data(), static_cast<int>(b.cols()));
  // Columns at the same size, so that a small one is not hidden behind a large one.
  Random random(kProbeSeed);
  VecX signs(b.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    const double size = x.col(j).lpNorm<Eigen::Infinity>();
    signs[j] = (random.uniform() < 0.5 ? -1.0 : 1.0) / (size > 0.0 ? size : 1.0);
  }
  const VecX mixed_b = scaled_b * signs, mixed_x = x * signs;
  VecX residual;
  SolveCheck check = {impl_->backward_error(mixed_b, mixed_x, residual), 0};
  if (!(check.backward_error <= kMaxBackwardError)) {
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      VecX column = x.col(j);
      if (auto ok = impl_->refine(scaled_b.col(j), column, check); !ok) return ok;
      x.col(j) = column;
    }
  }
  impl_->keep(check);
  x = (impl_->scale.asDiagonal() * x).eval();
  return {};
}

int SymmetricIndefinite::size() const { return impl_->mumps.n; }
double SymmetricIndefinite::rcond() const { return impl_->rcond; }
std::uint64_t SymmetricIndefinite::nonzeros() const {
  const int entries = impl_->mumps.infog[28];  // in millions when negative
  return entries < 0 ? static_cast<std::uint64_t>(-static_cast<long>(entries)) * 1000000
                     : static_cast<std::uint64_t>(entries);
}
std::uint64_t SymmetricIndefinite::bytes() const {
  const auto matrix = static_cast<std::uint64_t>(impl_->scaled.nonZeros());
  return nonzeros() * sizeof(double) + matrix * (sizeof(double) + sizeof(long) + 2 * sizeof(int));
}
double SymmetricIndefinite::analyse_seconds() const { return impl_->analyse_s; }
double SymmetricIndefinite::factor_seconds() const { return impl_->factor_s; }
SymmetricIndefinite::SolveCheck SymmetricIndefinite::last_check() const {
  const std::lock_guard lock(mumps_mutex());
  return impl_->last;
}

}  // namespace brainshift::linalg
