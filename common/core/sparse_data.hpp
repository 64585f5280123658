// SPDX-License-Identifier: Apache-2.0
// SparseData: displacements at points of the undeformed brain; the d of the paper's eq. 4.
//
//   d = A u + common_error c + e,   c ~ N(0, I),   e ~ N(0, diag(sd^2))
// Assumption: errors are zero-mean and Gaussian; e is independent from datum to datum and isotropic, and what the
// data have in common (an alignment that is off) is in common_error. Methods that know independent errors only, as
// the paper's does, leave common_error out.
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift {

struct SparseData {
  Points positions;      // 3 x m, undeformed, mm RAS
  Points displacements;  // 3 x m, mm
  VecX sd_mm;            // m, standard deviation per component
  // 3m x q, mm, q <= kMaxCommonErrors; row 3 i + axis belongs to datum i. No rows: none.
  Eigen::MatrixXd common_error = {};

  static constexpr int kMaxCommonErrors = 9;

  int size() const { return static_cast<int>(positions.cols()); }
};

}  // namespace brainshift
