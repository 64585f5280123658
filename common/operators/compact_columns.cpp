// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/compact_columns.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace brainshift {
namespace {

constexpr float kWord = 256.0F;  // a wide coefficient is so many times its word, plus its byte

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

// sum = sum over terms of factor * step * column, for `rows` whole numbers per column. Four columns
// in one pass take less time than four passes.
template <typename T>
BRAINSHIFT_INLINE void sum_columns(const T* values, int rows, const float* steps,
                                   std::span<const CompactColumns::Term> terms,
                                   float* __restrict sum) {
  std::fill(sum, sum + rows, 0.0F);
  const auto column = [&](std::size_t t) {
    return values + static_cast<std::ptrdiff_t>(terms[t].column) * rows;
  };
  const auto factor = [&](std::size_t t) { return terms[t].factor * steps[terms[t].column]; };
  std::size_t t = 0;
  for (; t + 4 <= terms.size(); t += 4) {
    const T *a = column(t), *b = column(t + 1), *c = column(t + 2), *d = column(t + 3);
    const float fa = factor(t), fb = factor(t + 1), fc = factor(t + 2), fd = factor(t + 3);
    for (int i = 0; i < rows; ++i) {
      sum[i] = (((sum[i] + fa * static_cast<float>(a[i])) + fb * static_cast<float>(b[i])) +
                fc * static_cast<float>(c[i])) +
               fd * static_cast<float>(d[i]);
    }
  }
  for (; t < terms.size(); ++t) {
    const T* a = column(t);
    const float fa = factor(t);
    for (int i = 0; i < rows; ++i) sum[i] += fa * static_cast<float>(a[i]);
  }
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

BRAINSHIFT_INLINE void sum_block(const CompactColumns::BlockArrays& block,
                                 std::span<const CompactColumns::Term> terms, float* out) {
  const int words = block.wide + block.middle, bytes = block.wide + block.narrow;
  float word_sum[CompactColumns::kBlockRows], byte_sum[CompactColumns::kBlockRows];
  sum_columns(block.words, words, block.steps, terms, word_sum);
  sum_columns(block.bytes, bytes, block.steps, terms, byte_sum);
  for (int i = 0; i < block.wide; ++i) word_sum[i] = kWord * word_sum[i] + byte_sum[i];
  const float* narrow_scales = block.scales + block.middle;
  for (int i = 0; i < block.middle; ++i) word_sum[block.wide + i] *= block.scales[i];
  for (int i = 0; i < block.narrow; ++i) byte_sum[block.wide + i] *= narrow_scales[i];

  const std::int16_t* narrow_basis =
      block.basis + static_cast<std::ptrdiff_t>(block.rows) * block.middle;
  std::fill(out, out + block.rows, 0.0F);
  add_product(block.wide_basis, block.rows, block.wide, word_sum, out);
  add_product(block.basis, block.rows, block.middle, word_sum + block.wide, out);
  add_product(narrow_basis, block.rows, block.narrow, byte_sum + block.wide, out);
}
BRAINSHIFT_AVX2 void sum_block_avx2(const CompactColumns::BlockArrays& block,
                                    std::span<const CompactColumns::Term> terms, float* out) {
  sum_block(block, terms, out);
}
void sum_block_anywhere(const CompactColumns::BlockArrays& block,
                        std::span<const CompactColumns::Term> terms, float* out) {
  sum_block(block, terms, out);
}

template <typename List>
Status check_size(const char* name, const List& list, std::ptrdiff_t size) {
  if (static_cast<std::ptrdiff_t>(list.size()) == size) return {};
  return fail(ErrorCode::kInvalidArgument, std::string(name) + " has " +
                                               std::to_string(list.size()) + " numbers: must be " +
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
         same(a.basis_scales, b.basis_scales) && same(a.words, b.words) && same(a.bytes, b.bytes);
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
    return fail(ErrorCode::kInvalidArgument, "steps holds a number that is not above 0");
  }
  if (auto status = made.check_sizes(); !status) return tl::unexpected(status.error());
  if (auto status = made.check_order(); !status) return tl::unexpected(status.error());
  return made;
}

Status CompactColumns::check_sizes() {
  Offsets next;
  const auto columns = static_cast<std::ptrdiff_t>(parts_.steps.size());
  for (Eigen::Index b = 0; b < parts_.blocks.cols(); ++b) {
    const Eigen::Vector4i block = parts_.blocks.col(b);
    const int most = 3 * std::clamp(block[0], 0, kBlockNodes);
    if (next.node > num_nodes()) break;  // reported below
    if (block[0] < 1 || block[0] > kBlockNodes || block.minCoeff() < 0 ||
        block.tail<3>().maxCoeff() > most || block.tail<3>().sum() > most) {
      return fail(ErrorCode::kInvalidArgument,
                  "blocks: block " + std::to_string(b) + " has " + std::to_string(block[0]) +
                      " nodes and " + std::to_string(block[1]) + " + " + std::to_string(block[2]) +
                      " + " + std::to_string(block[3]) + " coefficients");
    }
    next.rows = 3 * block[0];
    next.wide = block[1];
    next.middle = block[2];
    next.narrow = block[3];
    next.rank = block.tail<3>().sum();
    offsets_.push_back(next);
    const std::ptrdiff_t coarse = next.middle + next.narrow;
    next.node += block[0];
    next.wide_basis += static_cast<std::ptrdiff_t>(next.rows) * next.wide;
    next.basis += next.rows * coarse;
    next.scales += coarse;
    next.words += columns * (next.wide + next.middle);
    next.bytes += columns * (next.wide + next.narrow);
  }
  for (const Status& status : {check_size("order", parts_.order, next.node),
                               check_size("wide_basis", parts_.wide_basis, next.wide_basis),
                               check_size("basis", parts_.basis, next.basis),
                               check_size("basis_scales", parts_.basis_scales, next.scales),
                               check_size("words", parts_.words, next.words),
                               check_size("bytes", parts_.bytes, next.bytes)}) {
    if (!status) return status;
  }
  return {};
}

Status CompactColumns::check_order() {
  const int n = num_nodes();
  places_.assign(static_cast<std::size_t>(n), Place{-1, 0});
  for (int b = 0; b < num_blocks(); ++b) {
    const std::span<const NodeIndex> own = nodes(b);
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (own[i] < 0 || own[i] >= n || place(own[i]).block >= 0) {
        return fail(ErrorCode::kInvalidArgument, "order does not name every node once");
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
         of(parts_.basis) + of(parts_.basis_scales) + of(parts_.words) + of(parts_.bytes) +
         of(offsets_) + of(places_);
}

CompactColumns::BlockArrays CompactColumns::arrays(int block) const {
  const Offsets& own = at(block);
  return {own.rows,
          own.wide,
          own.middle,
          own.narrow,
          parts_.steps.data(),
          parts_.wide_basis.data() + own.wide_basis,
          parts_.basis.data() + own.basis,
          parts_.basis_scales.data() + own.scales,
          parts_.words.data() + own.words,
          parts_.bytes.data() + own.bytes};
}

std::span<const NodeIndex> CompactColumns::nodes(int block) const {
  return {parts_.order.data() + at(block).node, static_cast<std::size_t>(at(block).rows / 3)};
}

void CompactColumns::sum(int block, std::span<const Term> terms, float* out) const {
  const BlockArrays arrays = this->arrays(block);
  have_avx2() ? sum_block_avx2(arrays, terms, out) : sum_block_anywhere(arrays, terms, out);
}

void CompactColumns::basis(int block, float* out) const {
  const BlockArrays own = arrays(block);
  const std::int16_t* next = own.basis;
  out = std::copy(own.wide_basis, own.wide_basis + static_cast<std::ptrdiff_t>(own.rows) * own.wide,
                  out);
  for (int j = 0; j < own.middle + own.narrow; ++j) {
    for (int i = 0; i < own.rows; ++i) *out++ = own.scales[j] * static_cast<float>(*next++);
  }
}

void CompactColumns::coefficients(int block, int column, float* out) const {
  const BlockArrays own = arrays(block);
  const float step = own.steps[column];
  const std::int16_t* word =
      own.words + static_cast<std::ptrdiff_t>(own.wide + own.middle) * column;
  const std::int8_t* byte = own.bytes + static_cast<std::ptrdiff_t>(own.wide + own.narrow) * column;
  for (int i = 0; i < own.wide; ++i) {
    *out++ = step * (kWord * static_cast<float>(word[i]) + static_cast<float>(byte[i]));
  }
  for (int i = 0; i < own.middle; ++i) *out++ = step * static_cast<float>(word[own.wide + i]);
  for (int i = 0; i < own.narrow; ++i) *out++ = step * static_cast<float>(byte[own.wide + i]);
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
