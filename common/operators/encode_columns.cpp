// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/encode_columns.hpp"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

#include "common/linalg/blas.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift {
namespace {

// Splits the places [begin, end) and appends the ends of their blocks.
void split(const Points& points, int most, int begin, int end, SpatialBlocks& blocks) {
  const int count = end - begin;
  if (count <= most) {
    if (count > 0) blocks.first.push_back(end);
    return;
  }
  const auto part = std::span(blocks.order)
                        .subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(count));
  Vec3 low = points.col(part.front()), high = low;
  for (const int i : part) {
    low = low.cwiseMin(points.col(i));
    high = high.cwiseMax(points.col(i));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  // Parts of whole blocks, so that all blocks are about as large.
  const int parts = (count + most - 1) / most;
  const int middle =
      static_cast<int>(static_cast<long>(count) * (parts / 2) / static_cast<long>(parts));
  std::nth_element(part.begin(), part.begin() + middle, part.end(), [&](int a, int b) {
    return points(axis, a) != points(axis, b) ? points(axis, a) < points(axis, b) : a < b;
  });
  split(points, most, begin, begin + middle, blocks);
  split(points, most, begin + middle, end, blocks);
}

}  // namespace

SpatialBlocks spatial_blocks(const Points& points, int most) {
  assert(most >= 1);
  SpatialBlocks blocks;
  blocks.order.resize(static_cast<std::size_t>(points.cols()));
  std::iota(blocks.order.begin(), blocks.order.end(), 0);
  split(points, most, 0, static_cast<int>(points.cols()), blocks);
  return blocks;
}

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

// Root mean square, over the columns, of a row that the basis may leave out: as much as rounding.
constexpr double kLeft = 0.29;
constexpr double kMaxByte = 127.0, kMaxWord = 32767.0;

// What one block adds to the arrays of CompactParts.
struct Block {
  int wide = 0, others = 0;
  std::vector<float> wide_basis, basis_scales;
  std::vector<std::int16_t> basis, words;
  std::vector<std::int8_t> lengths, bytes;
  std::vector<std::int32_t> longs;
};

// Cholesky of W with pivoting, in place: the columns of L until no diagonal element that is left
// exceeds `least`.
MatrixXd pivoted_cholesky(MatrixXd& w, double least) {
  const Index n = w.rows();
  VecX left = w.diagonal();
  const double noise = 1e-14 * (n > 0 ? left.maxCoeff() : 0.0);
  MatrixXd factor(n, n);
  Index rank = 0;
  for (; rank < n; ++rank) {
    Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    if (!(largest > std::max(least, noise))) break;
    auto column = factor.col(rank);
    column = w.col(pivot);
    column.noalias() -= factor.leftCols(rank) * factor.row(pivot).head(rank).transpose();
    column /= std::sqrt(largest);
    left = (left - column.cwiseAbs2()).cwiseMax(0.0);
    left[pivot] = 0.0;
  }
  return factor.leftCols(rank);
}

// Directions in the order in which the block keeps them: first those with a coefficient beyond
// kMaxWord (`wide` of them), and of each kind those first that the columns need most, so that what
// comes last can be left out of quiet columns. coefficients: columns x rank.
std::vector<Index> by_need(const MatrixXd& coefficients, int& wide) {
  std::vector<Index> order(static_cast<std::size_t>(coefficients.cols()));
  std::iota(order.begin(), order.end(), 0);
  const VecX squares = coefficients.colwise().squaredNorm();
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return squares[a] > squares[b]; });
  const auto middle = std::stable_partition(order.begin(), order.end(), [&](Index i) {
    return coefficients.col(i).cwiseAbs().maxCoeff() > kMaxWord;
  });
  wide = static_cast<int>(middle - order.begin());
  return order;
}

// Appends a direction to the block; -> what it now stands for.
VecX keep_direction(const VecX& direction, bool wide, Block& block) {
  if (wide) {
    const Eigen::VectorXf single = direction.cast<float>();
    block.wide_basis.insert(block.wide_basis.end(), single.begin(), single.end());
    return single.cast<double>();
  }
  const auto scale = static_cast<float>(direction.cwiseAbs().maxCoeff() / kMaxWord);
  block.basis_scales.push_back(scale);
  VecX kept(direction.size());
  for (Index i = 0; i < direction.size(); ++i) {
    const double whole =
        std::clamp(std::rint(direction[i] / static_cast<double>(scale)), -kMaxWord, kMaxWord);
    block.basis.push_back(static_cast<std::int16_t>(whole));
    kept[i] = static_cast<double>(scale) * whole;
  }
  return kept;
}

// Eights that reach beyond the last coefficient of a column above `limit`.
int eights_above(const VecX& coefficients, double limit) {
  Index end = coefficients.size();
  while (end > 0 && std::abs(coefficients[end - 1]) <= limit) --end;
  return static_cast<int>((end + CompactColumns::kTogether - 1) / CompactColumns::kTogether);
}

// Appends a column's whole-numbered coefficients.
void keep_coefficients(const VecX& coefficients, Block& block) {
  const int longs = eights_above(coefficients, kMaxWord);
  const int words = std::max(longs, eights_above(coefficients, kMaxByte));
  const int bytes = std::max(words, eights_above(coefficients, 0.0));
  for (const int length : {longs, words - longs, bytes - words}) {
    block.lengths.push_back(static_cast<std::int8_t>(length));
  }
  const auto append = [&](auto& list, int begin, int end) {
    for (Index i = CompactColumns::kTogether * begin; i < CompactColumns::kTogether * end; ++i) {
      const double value = i < coefficients.size() ? coefficients[i] : 0.0;
      list.push_back(static_cast<typename std::decay_t<decltype(list)>::value_type>(value));
    }
  };
  append(block.longs, 0, longs);
  append(block.words, longs, words);
  append(block.bytes, words, bytes);
}

// Encodes whole-numbered coefficients (columns x rank) in a basis (3m x rank); `decoded` (3m x
// columns) receives what the block stands for, in steps.
void fill(const MatrixXd& basis, const MatrixXd& coefficients, Block& block, MatrixXd& decoded) {
  const std::vector<Index> order = by_need(coefficients, block.wide);
  block.others = static_cast<int>(basis.cols()) - block.wide;
  MatrixXd kept(basis.rows(), basis.cols()), sorted(coefficients.rows(), coefficients.cols());
  for (std::size_t j = 0; j < order.size(); ++j) {
    const auto to = static_cast<Index>(j);
    sorted.col(to) = coefficients.col(order[j]);
    kept.col(to) = keep_direction(basis.col(order[j]), to < block.wide, block);
  }
  for (Index c = 0; c < sorted.rows(); ++c) keep_coefficients(sorted.row(c).transpose(), block);
  linalg::blas::multiply_by_transposed(1.0, kept, sorted, 0.0, decoded);
}

class Encoder {
 public:
  Encoder(const std::vector<ColumnGroup>& groups, const Eigen::VectorXf& steps)
      : groups_(groups), steps_(steps) {}

  // nodes: those that stand at `place` and behind it in the order of all blocks.
  Result<Block> encode(std::span<const NodeIndex> nodes, Index place) const {
    MatrixXd rows(3 * static_cast<Index>(nodes.size()), steps_.size());
    if (auto ok = read_in_steps(nodes, place, rows); !ok) return tl::unexpected(ok.error());
    MatrixXd w = MatrixXd::Zero(rows.rows(), rows.rows()), decoded(rows.rows(), rows.cols());
    linalg::blas::subtract_outer(rows, w);
    w = (-w).eval();
    w.triangularView<Eigen::StrictlyUpper>() = w.transpose();
    double least = kLeft * kLeft * static_cast<double>(rows.cols());
    for (;;) {
      const MatrixXd factor = pivoted_cholesky(w, least);
      Block block;
      if (factor.cols() == 0) {
        decoded.setZero();
        block.lengths.assign(3 * static_cast<std::size_t>(rows.cols()), 0);
      } else {
        MatrixXd basis = factor;
        linalg::blas::orthonormalise(basis);
        MatrixXd coefficients(rows.cols(), basis.cols());
        linalg::blas::multiply_transposed(1.0, rows, basis, 0.0, coefficients);
        coefficients = coefficients.array().rint().matrix();
        fill(basis, coefficients, block, decoded);
      }
      const double worst = worst_error(rows, decoded);
      if (worst <= kMaxErrorSteps) return block;
      if (factor.cols() == rows.rows() || least == 0.0) {
        return fail(ErrorCode::kInternal,
                    "compact columns: a number is off by " + std::to_string(worst) + " steps");
      }
      least = least > 1e-6 ? least / 4.0 : 0.0;
    }
  }

 private:
  // In steps, or in those of kFinest where a column's are finer.
  double worst_error(const MatrixXd& rows, const MatrixXd& decoded) const {
    double worst = 0.0;
    Index first = 0;
    for (const ColumnGroup& group : groups_) {
      const Index count = group.count;
      if (rows.rows() > 0 && count > 0) {
        const double apart = (rows.middleCols(first, count) - decoded.middleCols(first, count))
                                 .cwiseAbs()
                                 .maxCoeff();
        worst = std::max(worst, apart * static_cast<double>(std::min(1.0F, group.step / kFinest)));
      }
      first += count;
    }
    return worst;
  }

  Status read_in_steps(std::span<const NodeIndex> nodes, Index place, MatrixXd& rows) const {
    MatrixXf read;
    Index first = 0;
    for (const ColumnGroup& group : groups_) {
      read.resize(rows.rows(), group.count);
      if (auto status = group.rows(nodes, place, read); !status) return status;
      for (Index j = 0; j < group.count; ++j, ++first) {
        const double per_step = 1.0 / static_cast<double>(steps_[first]);
        rows.col(first) = per_step * read.col(j).cast<double>();
      }
    }
    return {};
  }

  const std::vector<ColumnGroup>& groups_;
  const Eigen::VectorXf& steps_;
};

// Frees every array as it is taken over, and hands the memory back as it goes: of a fine mesh they
// are half of what there is.
void join(std::vector<Block>& blocks, CompactParts& parts) {
  constexpr std::size_t kHandBack = 256u << 20;
  std::size_t freed = 0;
  const auto take = [&](auto& list, auto member) {
    Index size = 0;
    for (const Block& block : blocks) size += static_cast<Index>((block.*member).size());
    list.resize(size);
    Index at = 0;
    for (Block& block : blocks) {
      const auto own = std::exchange(block.*member, {});
      std::copy(own.begin(), own.end(), list.data() + at);
      at += static_cast<Index>(own.size());
      freed += own.size() * sizeof own[0];
      if (freed > kHandBack) {
        ::malloc_trim(0);
        freed = 0;
      }
    }
  };
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    parts.blocks.col(static_cast<Index>(b)).tail<2>() << blocks[b].wide, blocks[b].others;
  }
  take(parts.wide_basis, &Block::wide_basis);
  take(parts.basis, &Block::basis);
  take(parts.basis_scales, &Block::basis_scales);
  take(parts.lengths, &Block::lengths);
  take(parts.longs, &Block::longs);
  take(parts.words, &Block::words);
  take(parts.bytes, &Block::bytes);
}

// Brings the lists of all processes, whose blocks are consecutive, to the first one; one list at a
// time, freed as it is sent.
void gather(Ranks& ranks, int own, int end, CompactParts& parts) {
  const auto all = [&](auto& list) {
    using Number = std::remove_reference_t<decltype(*list.data())>;
    std::vector<Ranks::Bytes> to(static_cast<std::size_t>(ranks.size()));
    const auto* bytes = reinterpret_cast<const std::byte*>(list.data());
    if (ranks.rank() > 0) {
      to[0].assign(bytes, bytes + static_cast<std::size_t>(list.size()) * sizeof(Number));
      list.resize(0);
    }
    auto from = ranks.exchange(std::move(to));
    if (ranks.rank() > 0) return;
    Index size = list.size();
    for (const Ranks::Bytes& message : from) {
      size += static_cast<Index>(message.size() / sizeof(Number));
    }
    Index at = list.size();
    list.conservativeResize(size);
    for (Ranks::Bytes& message : from) {
      if (!message.empty()) std::memcpy(list.data() + at, message.data(), message.size());
      at += static_cast<Index>(message.size() / sizeof(Number));
      message = {};
    }
  };
  CompactParts::List<int> blocks = parts.blocks.middleCols(own, end - own).reshaped();
  all(blocks);
  if (ranks.rank() == 0) parts.blocks.reshaped() = blocks;
  all(parts.wide_basis);
  all(parts.basis);
  all(parts.basis_scales);
  all(parts.lengths);
  all(parts.longs);
  all(parts.words);
  all(parts.bytes);
}

// A step for every column of a group; above 0 also where it has no other numbers than 0.
Status append_steps(const ColumnGroup& group, Eigen::VectorXf& steps) {
  if (!std::isfinite(group.greatest)) {
    return fail(ErrorCode::kNotFinite, "compact columns: a number is not finite");
  }
  const Index before = steps.size();
  steps.conservativeResize(before + group.count);
  steps.tail(group.count)
      .setConstant(std::max(group.step * group.greatest, std::numeric_limits<float>::min()));
  return {};
}

}  // namespace

float greatest_of(const MatrixXf& numbers) {
  if (!numbers.allFinite()) return std::numeric_limits<float>::quiet_NaN();
  return numbers.size() > 0 ? numbers.cwiseAbs().maxCoeff() : 0.0F;
}

ColumnGroup group_of(const MatrixXf& columns, float step) {
  ColumnGroup group;
  group.count = static_cast<int>(columns.cols());
  group.step = step;
  group.greatest = greatest_of(columns);
  group.rows = [&columns](std::span<const NodeIndex> nodes, Index, MatrixXf& rows) -> Status {
    for (Index j = 0; j < columns.cols(); ++j) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        rows.col(j).segment<3>(3 * static_cast<Index>(i)) =
            columns.col(j).segment<3>(3L * nodes[i]);
      }
    }
    return {};
  };
  return group;
}

SpatialBlocks node_blocks(const Points& nodes) {
  return spatial_blocks(nodes, CompactColumns::kBlockNodes);
}

Result<CompactColumns> encode_columns(const SpatialBlocks& nodes,
                                      const std::vector<ColumnGroup>& groups, ThreadTeam& team,
                                      const Progress& progress, const std::stop_token& stop,
                                      Ranks* ranks) {
  linalg::use_single_threaded_blas();
  const int own = ranks != nullptr ? ranks->first(ranks->rank(), nodes.size()) : 0;
  const int end = ranks != nullptr ? ranks->first(ranks->rank() + 1, nodes.size()) : nodes.size();
  CompactParts parts;
  for (const ColumnGroup& group : groups) {
    if (auto ok = append_steps(group, parts.steps); !ok) return tl::unexpected(ok.error());
  }
  parts.order = nodes.order;
  parts.blocks.setZero(3, nodes.size());

  std::vector<Block> blocks(static_cast<std::size_t>(nodes.size()));
  std::vector<Status> statuses(static_cast<std::size_t>(team.size()));
  std::atomic<int> done{0};
  const Encoder encoder(groups, parts.steps);
  auto task = [&](int member) {
    for (int b = own + member; b < end; b += team.size()) {
      if (stop.stop_requested()) return;
      const auto at = static_cast<std::size_t>(b);
      auto made = encoder.encode(nodes.block(b), nodes.first[at]);
      if (!made) {
        statuses[static_cast<std::size_t>(member)] = tl::unexpected(made.error());
        return;
      }
      blocks[at] = std::move(*made);
      parts.blocks(0, b) = static_cast<int>(nodes.block(b).size());
      ++done;
      if (member == 0) {
        report(progress, "compact columns", static_cast<double>(done) / (end - own));
      }
    }
  };
  report(progress, "compact columns", 0.0);
  team.run(task);
  report(progress, "compact columns", 1.0);
  Status all;
  if (done != end - own) all = fail(ErrorCode::kUnavailable, "preparation was stopped");
  for (const Status& status : statuses) {
    if (!status) all = status;
  }
  if (ranks != nullptr) all = ranks->agree(all);
  if (!all) return tl::unexpected(all.error());
  join(blocks, parts);
  if (ranks != nullptr) {
    gather(*ranks, own, end, parts);
    if (ranks->rank() > 0) return CompactColumns();
  }
  return CompactColumns::from_parts(std::move(parts));
}

std::vector<int> column_range(int first, int count) {
  std::vector<int> range(static_cast<std::size_t>(count));
  std::iota(range.begin(), range.end(), first);
  return range;
}

MatrixXf decode_rows(const CompactColumns& columns, const std::vector<NodeIndex>& nodes,
                     const std::vector<int>& which, ThreadTeam& team) {
  const auto count = static_cast<Index>(which.size());
  MatrixXf out(3 * static_cast<Index>(nodes.size()), count);
  std::vector<std::vector<Index>> wanted(static_cast<std::size_t>(columns.num_blocks()));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    wanted[static_cast<std::size_t>(columns.place(nodes[i]).block)].push_back(
        static_cast<Index>(i));
  }
  std::vector<int> blocks;
  for (int b = 0; b < columns.num_blocks(); ++b) {
    if (!wanted[static_cast<std::size_t>(b)].empty()) blocks.push_back(b);
  }
  const auto decode = [&](int block) {
    const std::vector<Index>& own = wanted[static_cast<std::size_t>(block)];
    const Index rank = columns.rank(block);
    MatrixXf basis(3 * static_cast<Index>(columns.nodes(block).size()), rank);
    MatrixXf coefficients(rank, count), rows(3 * static_cast<Index>(own.size()), rank);
    columns.basis(block, basis.data());
    for (Index j = 0; j < count; ++j) {
      columns.coefficients(block, which[static_cast<std::size_t>(j)],
                           coefficients.data() + j * rank);
    }
    for (std::size_t i = 0; i < own.size(); ++i) {
      const int at = columns.place(nodes[static_cast<std::size_t>(own[i])]).node;
      rows.middleRows<3>(3 * static_cast<Index>(i)) = basis.middleRows<3>(3L * at);
    }
    MatrixXf values = MatrixXf::Zero(rows.rows(), count);
    if (rank > 0 && count > 0) linalg::blas::multiply(1.0F, rows, coefficients, 0.0F, values);
    for (std::size_t i = 0; i < own.size(); ++i) {
      out.middleRows<3>(3 * own[i]) = values.middleRows<3>(3 * static_cast<Index>(i));
    }
  };
  team.split(static_cast<long>(blocks.size()), [&](long begin, long end) {
    for (long b = begin; b < end; ++b) decode(blocks[static_cast<std::size_t>(b)]);
  });
  return out;
}

}  // namespace brainshift
