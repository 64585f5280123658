// SPDX-License-Identifier: Apache-2.0
// SparseData: displacements at points of the undeformed brain; the d of the paper's eq. 4.
//
// Assumption: the errors of different data are independent, zero-mean, Gaussian, isotropic.
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift {

struct SparseData {
  Points positions;      // 3 x m, undeformed, mm RAS
  Points displacements;  // 3 x m, mm
  VecX sd_mm;            // m, standard deviation per component

  int size() const { return static_cast<int>(positions.cols()); }
};

}  // namespace brainshift
