// SPDX-License-Identifier: GPL-3.0-or-later
// SymmetricMatrix: a sparse symmetric matrix as its lower triangle, diagonal included, compressed
// by columns with sorted rows. Every factorisation of this folder takes one.
#pragma once

#include <Eigen/SparseCore>

#include "common/core/types.hpp"

namespace brainshift::linalg {

using SymmetricMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, long>;

// y = A x, with A given by its lower triangle. Sizes must agree.
VecX multiply(const SymmetricMatrix& lower, const VecX& x);

// Largest row sum of absolute values of the whole symmetric matrix: |A|_inf. 0 for an empty
// matrix.
double max_norm(const SymmetricMatrix& lower);

}  // namespace brainshift::linalg
