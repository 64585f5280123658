// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/compact_columns.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace brainshift {
namespace {

// The loops are compiled twice: for any processor, and for those with AVX2, which take the whole
// numbers eight at a time. Both do the same operations on every number in the same order, and
// neither has fused ones, so that the bits agree.
#if defined(__x86_64__)
#define BRAINSHIFT_AVX2 __attribute__((target("avx2")))
bool have_avx2() {
  static const bool have = __builtin_cpu_supports("avx2") != 0;
  return have;
}
#else
#define BRAINSHIFT_AVX2
bool have_avx2() { return false; }
#endif
#define BRAINSHIFT_INLINE [[gnu::always_inline]] inline

// sum += factor * values, for a whole number of kTogether; -> the place behind.
template <typename T>
BRAINSHIFT_INLINE float* add_scaled(const T* values, int together, float factor,
                                    float* __restrict sum) {
  const int count = CompactColumns::kTogether * together;
  for (int i = 0; i < count; ++i) sum[i] += factor * static_cast<float>(values[i]);
  return sum + count;
}

// out += basis * x; `basis` has rows x count numbers.
template <typename T>
BRAINSHIFT_INLINE void add_product(const T* basis, int rows, int count, const float* x,
                                   float* __restrict out) {
  int j = 0;
  for (; j + 4 <= count; j += 4) {
    const T *a = basis + static_cast<std::ptrdiff_t>(j) * rows, *b = a + rows, *c = b + rows,
            *d = c + rows;
    const float fa = x[j], fb = x[j + 1], fc = x[j + 2], fd = x[j + 3];
    for (int i = 0; i < rows; ++i) {
      out[i] = (((out[i] + fa * static_cast<float>(a[i])) + fb * static_cast<float>(b[i])) +
                fc * static_cast<float>(c[i])) +
               fd * static_cast<float>(d[i]);
    }
  }
  for (; j < count; ++j) {
    const T* a = basis + static_cast<std::ptrdiff_t>(j) * rows;
    for (int i = 0; i < rows; ++i) out[i] += x[j] * static_cast<float>(a[i]);
  }
}

// Asks for a column's coefficients before they are needed: they stand in short pieces of three
// arrays, which no processor foresees.
BRAINSHIFT_INLINE void prefetch(const CompactColumns::BlockArrays& block, int column) {
  constexpr std::ptrdiff_t kLine = 64;
  const std::int8_t* length = block.lengths + 3 * static_cast<std::ptrdiff_t>(column);
  const CompactColumns::Start& start = block.starts[column];
  const auto lines = [](const auto* from, int together) {
    const char* at = reinterpret_cast<const char*>(from);
    const char* end = at + CompactColumns::kTogether * together * std::ptrdiff_t{sizeof(*from)};
    for (; at < end; at += kLine) __builtin_prefetch(at);
  };
  lines(block.longs + start.longs, length[0]);
  lines(block.words + start.words, length[1]);
  lines(block.bytes + start.bytes, length[2]);
}

BRAINSHIFT_INLINE void sum_block(const CompactColumns::BlockArrays& block,
                                 std::span<const CompactColumns::Term> terms, float omitted,
                                 float* out) {
  float sum[CompactColumns::kBlockRows];
  std::fill(sum, sum + CompactColumns::kBlockRows, 0.0F);
  constexpr std::size_t kAhead = 4;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (t + kAhead < terms.size()) prefetch(block, terms[t + kAhead].column);
    const CompactColumns::Term& term = terms[t];
    const float factor = term.factor * block.steps[term.column];
    const std::int8_t* length = block.lengths + 3 * static_cast<std::ptrdiff_t>(term.column);
    const CompactColumns::Start& start = block.starts[term.column];
    float* next = add_scaled(block.longs + start.longs, length[0], factor, sum);
    next = add_scaled(block.words + start.words, length[1], factor, next);
    add_scaled(block.bytes + start.bytes, length[2], factor, next);
  }
  int used = block.wide + block.others;  // directions; they are orthonormal
  for (float rest = omitted * omitted; used > 0; --used) {
    rest -= sum[used - 1] * sum[used - 1];
    if (!(rest >= 0.0F)) break;
  }
  const int wide = std::min(used, block.wide), others = used - wide;
  for (int i = 0; i < others; ++i) sum[wide + i] *= block.scales[i];
  std::fill(out, out + block.rows, 0.0F);
  add_product(block.wide_basis, block.rows, wide, sum, out);
  add_product(block.basis, block.rows, others, sum + wide, out);
}
BRAINSHIFT_AVX2 void sum_block_avx2(const CompactColumns::BlockArrays& block,
                                    std::span<const CompactColumns::Term> terms, float omitted,
                                    float* out) {
  sum_block(block, terms, omitted, out);
}
void sum_block_anywhere(const CompactColumns::BlockArrays& block,
                        std::span<const CompactColumns::Term> terms, float omitted, float* out) {
  sum_block(block, terms, omitted, out);
}

template <typename List>
Status check_size(const char* name, const List& list, std::ptrdiff_t size) {
  if (static_cast<std::ptrdiff_t>(list.size()) == size) return {};
  return invalid(std::string(name) + " has " + std::to_string(list.size()) + " numbers: must be " +
                 std::to_string(size));
}

Status check_finite(const char* name, const CompactParts::List<float>& list) {
  if (list.allFinite()) return {};
  return fail(ErrorCode::kNotFinite, std::string(name) + " holds a number that is not finite");
}

}  // namespace

bool operator==(const CompactParts& a, const CompactParts& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.cols() == y.cols() && x.rows() == y.rows() && x == y;
  };
  return a.order == b.order && same(a.steps, b.steps) && same(a.blocks, b.blocks) &&
         same(a.wide_basis, b.wide_basis) && same(a.basis, b.basis) &&
         same(a.basis_scales, b.basis_scales) && same(a.lengths, b.lengths) &&
         same(a.longs, b.longs) && same(a.words, b.words) && same(a.bytes, b.bytes);
}

Result<CompactColumns> CompactColumns::from_parts(CompactParts parts) {
  CompactColumns made;
  made.parts_ = std::move(parts);
  const CompactParts& given = made.parts_;
  for (const auto& [name, list] :
       {std::pair{"steps", &given.steps}, std::pair{"wide_basis", &given.wide_basis},
        std::pair{"basis_scales", &given.basis_scales}}) {
    if (auto status = check_finite(name, *list); !status) return tl::unexpected(status.error());
  }
  if (given.steps.size() > 0 && !(given.steps.minCoeff() > 0.0F)) {
    return invalid("steps holds a number that is not above 0");
  }
  if (auto status = made.check_sizes(); !status) return tl::unexpected(status.error());
  if (auto status = made.check_order(); !status) return tl::unexpected(status.error());
  return made;
}

Status CompactColumns::check_sizes() {
  Offsets next;
  const Eigen::Index columns = parts_.steps.size();
  if (auto status = check_size("lengths", parts_.lengths, 3 * columns * parts_.blocks.cols());
      !status) {
    return status;
  }
  starts_.reserve(static_cast<std::size_t>(columns * parts_.blocks.cols()));
  for (Eigen::Index b = 0; b < parts_.blocks.cols(); ++b) {
    const Eigen::Vector3i block = parts_.blocks.col(b);
    const int most = 3 * std::clamp(block[0], 0, kBlockNodes);
    if (next.node > num_nodes()) break;  // reported below
    if (block[0] < 1 || block[0] > kBlockNodes || block.minCoeff() < 0 ||
        block.tail<2>().maxCoeff() > most || block.tail<2>().sum() > most) {
      return invalid("blocks: block " + std::to_string(b) + " has " + std::to_string(block[0]) +
                     " nodes and " + std::to_string(block[1]) + " + " + std::to_string(block[2]) +
                     " directions");
    }
    next.rows = 3 * block[0];
    next.wide = block[1];
    next.others = block[2];
    next.rank = next.wide + next.others;
    offsets_.push_back(next);
    next.node += block[0];
    next.wide_basis += static_cast<std::ptrdiff_t>(next.rows) * next.wide;
    next.basis += static_cast<std::ptrdiff_t>(next.rows) * next.others;
    next.scales += next.others;
    if (auto status = check_lengths(b, next); !status) return status;
  }
  for (const Status& status : {check_size("order", parts_.order, next.node),
                               check_size("wide_basis", parts_.wide_basis, next.wide_basis),
                               check_size("basis", parts_.basis, next.basis),
                               check_size("basis_scales", parts_.basis_scales, next.scales),
                               check_size("longs", parts_.longs, next.longs),
                               check_size("words", parts_.words, next.words),
                               check_size("bytes", parts_.bytes, next.bytes)}) {
    if (!status) return status;
  }
  return {};
}

Status CompactColumns::check_lengths(Eigen::Index block, Offsets& next) {
  const int columns = num_columns(), most = (next.rank + kTogether - 1) / kTogether;
  const std::int8_t* own = parts_.lengths.data() + 3 * columns * block;
  Start start;
  for (int j = 0; j < columns; ++j, own += 3) {
    if (own[0] < 0 || own[1] < 0 || own[2] < 0 || own[0] + own[1] + own[2] > most) {
      return invalid("lengths: column " + std::to_string(j) + " of block " + std::to_string(block) +
                     " has " + std::to_string(own[0]) + " + " + std::to_string(own[1]) + " + " +
                     std::to_string(own[2]) + " eights of coefficients, the block " +
                     std::to_string(next.rank) + " directions");
    }
    starts_.push_back(start);
    start.longs += static_cast<std::uint32_t>(kTogether * own[0]);
    start.words += static_cast<std::uint32_t>(kTogether * own[1]);
    start.bytes += static_cast<std::uint32_t>(kTogether * own[2]);
  }
  next.longs += start.longs;
  next.words += start.words;
  next.bytes += start.bytes;
  return {};
}

Status CompactColumns::check_order() {
  const int n = num_nodes();
  places_.assign(static_cast<std::size_t>(n), Place{-1, 0});
  for (int b = 0; b < num_blocks(); ++b) {
    const std::span<const NodeIndex> own = nodes(b);
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (own[i] < 0 || own[i] >= n || place(own[i]).block >= 0) {
        return invalid("order does not name every node once");
      }
      places_[static_cast<std::size_t>(own[i])] = {b, static_cast<int>(i)};
    }
  }
  return {};
}

std::uint64_t CompactColumns::bytes() const {
  const auto of = [](const auto& list) -> std::uint64_t {
    return static_cast<std::uint64_t>(list.size()) * sizeof(*list.data());
  };
  return of(parts_.steps) + of(parts_.order) + of(parts_.blocks) + of(parts_.wide_basis) +
         of(parts_.basis) + of(parts_.basis_scales) + of(parts_.lengths) + of(parts_.longs) +
         of(parts_.words) + of(parts_.bytes) + of(offsets_) + of(starts_) + of(places_);
}

CompactColumns::BlockArrays CompactColumns::arrays(int block) const {
  const Offsets& own = at(block);
  const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(num_columns()) * block;
  return {own.rows,
          own.wide,
          own.others,
          parts_.steps.data(),
          parts_.wide_basis.data() + own.wide_basis,
          parts_.basis.data() + own.basis,
          parts_.basis_scales.data() + own.scales,
          parts_.lengths.data() + 3 * first,
          starts_.data() + first,
          parts_.longs.data() + own.longs,
          parts_.words.data() + own.words,
          parts_.bytes.data() + own.bytes};
}

std::span<const NodeIndex> CompactColumns::nodes(int block) const {
  return {parts_.order.data() + at(block).node, static_cast<std::size_t>(at(block).rows / 3)};
}

void CompactColumns::sum(int block, std::span<const Term> terms, float* out, float omitted) const {
  const BlockArrays arrays = this->arrays(block);
  have_avx2() ? sum_block_avx2(arrays, terms, omitted, out)
              : sum_block_anywhere(arrays, terms, omitted, out);
}

void CompactColumns::basis(int block, float* out) const {
  const BlockArrays own = arrays(block);
  const std::int16_t* next = own.basis;
  out = std::copy(own.wide_basis, own.wide_basis + static_cast<std::ptrdiff_t>(own.rows) * own.wide,
                  out);
  for (int j = 0; j < own.others; ++j) {
    for (int i = 0; i < own.rows; ++i) *out++ = own.scales[j] * static_cast<float>(*next++);
  }
}

void CompactColumns::coefficients(int block, int column, float* out) const {
  const BlockArrays own = arrays(block);
  const float step = own.steps[column];
  const std::int8_t* length = own.lengths + 3 * static_cast<std::ptrdiff_t>(column);
  const Start& start = own.starts[column];
  float all[kBlockRows] = {};
  float* next = add_scaled(own.longs + start.longs, length[0], step, all);
  next = add_scaled(own.words + start.words, length[1], step, next);
  add_scaled(own.bytes + start.bytes, length[2], step, next);
  std::copy(all, all + rank(block), out);
}

double CompactColumns::squared_norm(int column) const {
  float own[kBlockRows];
  double sum = 0.0;
  for (int b = 0; b < num_blocks(); ++b) {
    coefficients(b, column, own);
    for (int i = 0; i < rank(b); ++i) sum += std::pow(static_cast<double>(own[i]), 2);
  }
  return sum;
}

}  // namespace brainshift
