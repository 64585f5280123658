// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/distributed_cholesky.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "common/core/random.hpp"
#include "common/core/stopwatch.hpp"

namespace brainshift::linalg {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Which unknowns are whose.
struct Partition {
  std::vector<std::vector<int>> interiors;  // of each part, sorted
  std::vector<int> interface;               // sorted
  std::vector<int> place;                   // of each unknown in its list
  std::vector<char> on_interface;
  std::vector<int> order;  // of the interface, as it is eliminated
};

// At which halving of [0, parts) p and q come apart, 0 the first.
int level_of(int p, int q, int parts) {
  int level = 0, low = 0, high = parts;
  for (; high - low > 1; ++level) {
    const int middle = low + (high - low) / 2;
    if ((p < middle) != (q < middle)) break;
    (p < middle ? high : low) = middle;
  }
  return level;
}

Partition divide(const SymmetricMatrix& lower, const std::vector<int>& part, int parts) {
  const auto n = static_cast<std::size_t>(lower.rows());
  Partition result;
  result.interiors.resize(static_cast<std::size_t>(parts));
  result.place.resize(n);
  result.on_interface.resize(n);
  std::vector<int> level(n, std::numeric_limits<int>::max());  // where it first parts others
  for (long j = 0; j < lower.outerSize(); ++j) {
    for (SymmetricMatrix::InnerIterator it(lower, j); it; ++it) {
      auto above = static_cast<std::size_t>(it.row()), below = static_cast<std::size_t>(j);
      if (part[above] == part[below]) continue;
      if (part[above] < part[below]) std::swap(above, below);
      result.on_interface[above] = 1;
      level[above] = std::min(level[above], level_of(part[above], part[below], parts));
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    auto& list =
        result.on_interface[i] != 0 ? result.interface : result.interiors[static_cast<std::size_t>(part[i])];
    result.place[i] = static_cast<int>(list.size());
    list.push_back(static_cast<int>(i));
  }
  // Nested dissection: what parts few comes before what parts many.
  result.order.resize(result.interface.size());
  std::iota(result.order.begin(), result.order.end(), 0);
  std::stable_sort(result.order.begin(), result.order.end(), [&](int a, int b) {
    const auto key = [&](int i) {
      const auto u = static_cast<std::size_t>(result.interface[static_cast<std::size_t>(i)]);
      return std::pair(-level[u], part[u]);
    };
    return key(a) < key(b);
  });
  return result;
}

// Numbers of a message, one after the other.
template <typename T>
void put(Ranks::Bytes& message, const T* numbers, std::size_t count) {
  if (count == 0) return;
  const std::size_t before = message.size();
  message.resize(before + count * sizeof(T));
  std::memcpy(message.data() + before, numbers, count * sizeof(T));
}
template <typename T>
void take(const std::byte*& at, T* numbers, std::size_t count) {
  if (count > 0) std::memcpy(numbers, at, count * sizeof(T));
  at += count * sizeof(T);
}

}  // namespace

struct DistributedCholesky::Impl {
  Ranks* ranks = nullptr;
  Partition partition;
  std::vector<int> meets;  // places on the interface that this process's interior meets
  std::optional<SparseCholesky> local;
  std::unique_ptr<SummedFactor> summed;
  double rcond = 0.0, analyse_s = 0.0, factor_s = 0.0;
  SparseCholesky::Workspace workspace;
  MatrixXd own, reduced, kept, ends, solved;

  const std::vector<int>& interior(int r) const {
    return partition.interiors[static_cast<std::size_t>(r)];
  }
  Status factorise_local(const SymmetricMatrix& lower);
  SummedMatrix summed_matrix(const SymmetricMatrix& lower) const;
  std::vector<int> gather_loads(const MatrixXd& b);
  void solve_interface(const MatrixXd& b, int first);
  void return_solutions(const std::vector<int>& counts, MatrixXd& x);
};

DistributedCholesky::DistributedCholesky(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DistributedCholesky::DistributedCholesky(DistributedCholesky&&) noexcept = default;
DistributedCholesky& DistributedCholesky::operator=(DistributedCholesky&&) noexcept = default;
DistributedCholesky::~DistributedCholesky() = default;

// K on the interior and on the interface that meets it. A principal part of K is positive definite
// as K is.
Status DistributedCholesky::Impl::factorise_local(const SymmetricMatrix& lower) {
  const auto n = static_cast<std::size_t>(lower.rows());
  std::vector<int> local_of(n, -1);
  const std::vector<int>& inner = interior(ranks->rank());
  for (std::size_t i = 0; i < inner.size(); ++i) {
    local_of[static_cast<std::size_t>(inner[i])] = static_cast<int>(i);
  }
  const auto is_inner = [&](std::size_t i) {
    return local_of[i] >= 0 && partition.on_interface[i] == 0;
  };
  std::vector<char> met(partition.interface.size());
  for (long j = 0; j < lower.outerSize(); ++j) {
    for (SymmetricMatrix::InnerIterator it(lower, j); it; ++it) {
      const auto a = static_cast<std::size_t>(it.row()), b = static_cast<std::size_t>(j);
      if (is_inner(a) && !is_inner(b)) met[static_cast<std::size_t>(partition.place[b])] = 1;
      if (is_inner(b) && !is_inner(a)) met[static_cast<std::size_t>(partition.place[a])] = 1;
    }
  }
  auto size = static_cast<int>(inner.size());
  for (std::size_t i = 0; i < met.size(); ++i) {
    if (met[i] == 0) continue;
    meets.push_back(static_cast<int>(i));
    local_of[static_cast<std::size_t>(partition.interface[i])] = size++;
  }
  if (inner.empty()) return {};
  std::vector<Eigen::Triplet<double, long>> entries;
  for (long j = 0; j < lower.outerSize(); ++j) {
    const long column = local_of[static_cast<std::size_t>(j)];
    if (column < 0) continue;
    for (SymmetricMatrix::InnerIterator it(lower, j); it; ++it) {
      const long row = local_of[static_cast<std::size_t>(it.row())];
      if (row >= 0) entries.emplace_back(std::max(row, column), std::min(row, column), it.value());
    }
  }
  SymmetricMatrix part(size, size);
  part.setFromTriplets(entries.begin(), entries.end());
  entries = {};
  auto factor = SparseCholesky::factorise(part, static_cast<int>(meets.size()));
  if (!factor) return tl::unexpected(factor.error());
  local = std::move(*factor);
  return {};
}

// This process's term of S; the first one adds K_bb.
SummedMatrix DistributedCholesky::Impl::summed_matrix(const SymmetricMatrix& lower) const {
  SummedMatrix sum;
  sum.size = static_cast<int>(partition.interface.size());
  sum.order = partition.order;
  const auto add = [&](int row, int column, double value) {
    sum.rows.push_back(std::max(row, column));
    sum.columns.push_back(std::min(row, column));
    sum.values.push_back(value);
  };
  const bool first = ranks->rank() == 0;
  std::vector<int> local_of(partition.interface.size(), -1);
  for (std::size_t i = 0; i < meets.size(); ++i) {
    local_of[static_cast<std::size_t>(meets[i])] = static_cast<int>(i);
  }
  MatrixXd term = local ? local->schur_complement() : MatrixXd();  // with the K_bb that it met
  for (const int unknown : partition.interface) {
    for (SymmetricMatrix::InnerIterator it(lower, unknown); it; ++it) {
      const auto row = static_cast<std::size_t>(it.row());
      if (partition.on_interface[row] == 0) continue;
      const int i = partition.place[row], j = partition.place[static_cast<std::size_t>(unknown)];
      if (first) add(i, j, it.value());
      const int a = local_of[static_cast<std::size_t>(i)],
                b = local_of[static_cast<std::size_t>(j)];
      if (local && a >= 0 && b >= 0) term(std::max(a, b), std::min(a, b)) -= it.value();
    }
  }
  for (Index j = 0; j < term.cols(); ++j) {
    for (Index i = j; i < term.rows(); ++i) {
      add(meets[static_cast<std::size_t>(i)], meets[static_cast<std::size_t>(j)], term(i, j));
    }
  }
  return sum;
}

Result<DistributedCholesky> DistributedCholesky::factorise(const SymmetricMatrix& lower,
                                                           const std::vector<int>& part,
                                                           Ranks& ranks) {
  assert(part.size() == static_cast<std::size_t>(lower.rows()));
  const Stopwatch watch;
  DistributedCholesky result(std::make_unique<Impl>());
  Impl& impl = *result.impl_;
  impl.ranks = &ranks;
  impl.partition = divide(lower, part, ranks.size());
  if (auto ok = ranks.agree(impl.factorise_local(lower)); !ok) return tl::unexpected(ok.error());
  impl.analyse_s = impl.local ? impl.local->analyse_seconds() : 0.0;
  if (!impl.partition.interface.empty()) {
    auto summed = ranks.factorise(impl.summed_matrix(lower));
    if (auto ok = ranks.agree(summed ? Status{} : tl::unexpected(summed.error())); !ok) {
      return tl::unexpected(ok.error());
    }
    impl.summed = std::move(*summed);
    if (impl.local) impl.local->drop_kept();
  }
  std::vector<double> rconds(static_cast<std::size_t>(ranks.size()));
  rconds[static_cast<std::size_t>(ranks.rank())] = impl.local ? impl.local->rcond() : 1.0;
  ranks.sum(rconds);
  impl.rcond = *std::min_element(rconds.begin(), rconds.end());
  impl.factor_s = watch.seconds() - impl.analyse_s;
  return result;
}

// Right-hand sides of all processes at the own interior, into `own`. -> how many each has.
// A message: their number, how many unknowns have a number at all, which, and the numbers.
std::vector<int> DistributedCholesky::Impl::gather_loads(const MatrixXd& b) {
  std::vector<Ranks::Bytes> messages(static_cast<std::size_t>(ranks->size()));
  for (int r = 0; r < ranks->size(); ++r) {
    Ranks::Bytes& message = messages[static_cast<std::size_t>(r)];
    std::vector<int> loaded;
    for (std::size_t i = 0; i < interior(r).size(); ++i) {
      if ((b.col(interior(r)[i]).array() != 0.0).any()) loaded.push_back(static_cast<int>(i));
    }
    const std::array<int, 2> head = {static_cast<int>(b.rows()), static_cast<int>(loaded.size())};
    const auto fields = static_cast<std::size_t>(b.rows());
    message.reserve(sizeof head + loaded.size() * (sizeof(int) + fields * sizeof(double)));
    put(message, head.data(), head.size());
    put(message, loaded.data(), loaded.size());
    for (const int i : loaded) {
      put(message, b.col(interior(r)[static_cast<std::size_t>(i)]).data(), fields);
    }
  }
  messages = ranks->exchange(std::move(messages));
  std::vector<int> counts;
  for (const Ranks::Bytes& message : messages) {
    const std::byte* at = message.data();
    take(at, &counts.emplace_back(), 1);
  }
  own.setZero(std::accumulate(counts.begin(), counts.end(), 0),
              static_cast<Index>(interior(ranks->rank()).size()));
  Index first = 0;
  for (std::size_t r = 0; r < messages.size(); ++r) {
    const std::byte* at = messages[r].data() + sizeof(int);
    int count = 0;
    take(at, &count, 1);
    std::vector<int> loaded(static_cast<std::size_t>(count));
    take(at, loaded.data(), loaded.size());
    for (const int i : loaded) {
      take(at, own.col(i).data() + first, static_cast<std::size_t>(counts[r]));
    }
    first += counts[r];
  }
  return counts;
}

// X_b of all right-hand sides into `ends`. first: of the own among all.
void DistributedCholesky::Impl::solve_interface(const MatrixXd& b, int first) {
  ends.setZero(own.rows(), static_cast<Index>(partition.interface.size()));
  if (local) local->reduce_rows(own, reduced, workspace);
  for (std::size_t i = 0; local && i < meets.size(); ++i) {
    ends.col(meets[i]) = reduced.col(static_cast<Index>(i));
  }
  for (std::size_t i = 0; i < partition.interface.size(); ++i) {
    ends.col(static_cast<Index>(i)).segment(first, b.rows()) += b.col(partition.interface[i]);
  }
  if (!summed) return;
  MatrixXd x;
  if (summed->solve(ends, x)) {
    ends.swap(x);
  } else {
    ends.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
}

void DistributedCholesky::Impl::return_solutions(const std::vector<int>& counts, MatrixXd& x) {
  std::vector<Ranks::Bytes> messages(counts.size());
  Index first = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    const auto count = static_cast<std::size_t>(counts[r]);
    messages[r].reserve(count * static_cast<std::size_t>(solved.cols()) * sizeof(double));
    for (Index i = 0; i < solved.cols(); ++i) put(messages[r], solved.col(i).data() + first, count);
    first += counts[r];
  }
  messages = ranks->exchange(std::move(messages));
  for (int r = 0; r < ranks->size(); ++r) {
    const std::byte* at = messages[static_cast<std::size_t>(r)].data();
    for (const int i : interior(r)) take(at, x.col(i).data(), static_cast<std::size_t>(x.rows()));
  }
}

void DistributedCholesky::solve_rows(const MatrixXd& b, MatrixXd& x) const {
  Impl& impl = *impl_;
  const std::vector<int> counts = impl.gather_loads(b);
  const int first = std::accumulate(counts.begin(), counts.begin() + impl.ranks->rank(), 0);
  impl.solve_interface(b, first);
  x.resize(b.rows(), b.cols());
  for (std::size_t i = 0; i < impl.partition.interface.size(); ++i) {
    x.col(impl.partition.interface[i]) =
        impl.ends.col(static_cast<Index>(i)).segment(first, b.rows());
  }
  impl.solved.resize(impl.own.rows(), 0);
  if (impl.local) {
    impl.kept.resize(impl.own.rows(), static_cast<Index>(impl.meets.size()));
    for (std::size_t i = 0; i < impl.meets.size(); ++i) {
      impl.kept.col(static_cast<Index>(i)) = impl.ends.col(impl.meets[i]);
    }
    impl.local->finish_rows(impl.kept, impl.solved, impl.workspace);
  }
  impl.return_solutions(counts, x);
}

void DistributedCholesky::solve(const VecX& b, VecX& x) const {
  MatrixXd rows;
  solve_rows(b.transpose(), rows);
  x = rows.row(0).transpose();
}

Ranks& DistributedCholesky::ranks() const { return *impl_->ranks; }
int DistributedCholesky::size() const { return static_cast<int>(impl_->partition.place.size()); }
int DistributedCholesky::interface_size() const {
  return static_cast<int>(impl_->partition.interface.size());
}
double DistributedCholesky::rcond() const { return impl_->rcond; }
std::uint64_t DistributedCholesky::nonzeros() const {
  return impl_->local ? impl_->local->nonzeros() : 0;
}
std::uint64_t DistributedCholesky::bytes() const {
  return (impl_->local ? impl_->local->bytes() : 0) + (impl_->summed ? impl_->summed->bytes() : 0);
}
double DistributedCholesky::analyse_seconds() const { return impl_->analyse_s; }
double DistributedCholesky::factor_seconds() const { return impl_->factor_s; }

Result<SolveQuality> check_rows(const SymmetricMatrix& lower, double norm,
                                const DistributedCholesky& factor, const MatrixXd& b,
                                const MatrixXd& x) {
  Random random(19670401);
  VecX signs(b.rows()), product;
  for (Index j = 0; j < signs.size(); ++j) signs[j] = random.uniform() < 0.5 ? -1.0 : 1.0;
  const VecX rhs = b.transpose() * signs, combined = x.transpose() * signs;
  const SolveQuality quality{backward_error(lower, norm, rhs, combined, product), 0};
  Status own;
  if (!(quality.backward_error <= kRefuseAbove)) {
    own = tl::unexpected(solve_refusal(rhs, combined, quality));
  }
  if (auto all = factor.ranks().agree(own); !all) return tl::unexpected(all.error());
  return quality;
}

}  // namespace brainshift::linalg
