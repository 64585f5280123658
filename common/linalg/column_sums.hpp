// SPDX-License-Identifier: GPL-3.0-or-later
// add_columns: out += sum over j of factor_j column_j, for columns that stand anywhere in memory.
//
// Eight columns in one pass, so that `out` is read and written once for eight of them. Every number
// is summed in the order of the columns, by the same operations wherever it stands: the sum of a
// row does not depend on how the rows are shared among threads. That is what BLAS does not promise:
// its kernels round the last numbers of an array otherwise than the others.
// Rounding of single precision: |error_i| <= (count + 1) 2^-24 sum_j |factor_j column_ij|.
#pragma once

#include <cstddef>

namespace brainshift::linalg {

// columns, factors: `count` of each. first, rows: the part of every column that is summed; out: its
// first number belongs to row `first`. Precondition: out overlaps no column.
template <typename T>
void add_columns(const T* const* columns, const T* factors, std::size_t count, std::ptrdiff_t first,
                 std::ptrdiff_t rows, T* __restrict out) {
  std::size_t j = 0;
  for (; j + 8 <= count; j += 8) {
    const T *a = columns[j] + first, *b = columns[j + 1] + first, *c = columns[j + 2] + first,
            *d = columns[j + 3] + first, *e = columns[j + 4] + first, *f = columns[j + 5] + first,
            *g = columns[j + 6] + first, *h = columns[j + 7] + first;
    const T fa = factors[j], fb = factors[j + 1], fc = factors[j + 2], fd = factors[j + 3],
            fe = factors[j + 4], ff = factors[j + 5], fg = factors[j + 6], fh = factors[j + 7];
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      const T half = (((out[i] + fa * a[i]) + fb * b[i]) + fc * c[i]) + fd * d[i];
      out[i] = (((half + fe * e[i]) + ff * f[i]) + fg * g[i]) + fh * h[i];
    }
  }
  for (; j < count; ++j) {
    const T* a = columns[j] + first;
    const T fa = factors[j];
    for (std::ptrdiff_t i = 0; i < rows; ++i) out[i] += fa * a[i];
  }
}

}  // namespace brainshift::linalg
