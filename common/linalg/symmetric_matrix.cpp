// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/symmetric_matrix.hpp"

#include <cmath>

namespace brainshift::linalg {

VecX multiply(const SymmetricMatrix& lower, const VecX& x) {
  return lower.selfadjointView<Eigen::Lower>() * x;
}

double max_norm(const SymmetricMatrix& lower) {
  VecX sums = VecX::Zero(lower.rows());
  for (Eigen::Index j = 0; j < lower.outerSize(); ++j) {
    for (SymmetricMatrix::InnerIterator it(lower, j); it; ++it) {
      const double size = std::abs(it.value());
      sums[it.row()] += size;
      if (it.row() != it.col()) sums[it.col()] += size;
    }
  }
  return sums.size() > 0 ? sums.maxCoeff() : 0.0;
}

}  // namespace brainshift::linalg
