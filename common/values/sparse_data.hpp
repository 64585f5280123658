// SPDX-License-Identifier: Apache-2.0
// SparseData: displacements at points of the undeformed brain; the d of the paper's eq. 4.
//
//   d = A u + common_error c + e,   c ~ N(0, I),   e ~ N(0, diag(sd^2))
// A datum is a whole displacement (three components) or, with a direction n, the part of it along n: a distance to a
// measured surface says nothing about sliding along it.
// Assumption: errors are zero-mean and Gaussian; e is independent from datum to datum and isotropic, and what the
// data have in common (an alignment that is off) is in common_error. Methods that know independent errors only, as
// the paper's does, leave common_error out.
#pragma once

#include <string>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift {

// Data `first` to `first + count - 1` come from one instrument.
struct DataSource {
  std::string name;  // Observation::source
  int first = 0;
  int count = 0;
};

struct SparseData {
  Points positions;      // 3 x m, undeformed, mm RAS
  Points displacements;  // 3 x m, mm; along a direction: (n . d) n
  VecX sd_mm;            // m, standard deviation per component
  // 3m x q, mm, q <= kMaxCommonErrors; row 3 i + axis belongs to datum i. No rows: none.
  Eigen::MatrixXd common_error = {};
  // 3 x m, a unit vector or zero (the whole displacement) per datum. No columns: all are whole.
  Points directions = {};
  // In the order of the data, each datum in one. Empty: one nameless source.
  std::vector<DataSource> sources = {};

  // An alignment has 12, a camera 6: room for the sources of an operating room.
  static constexpr int kMaxCommonErrors = 48;

  int size() const { return static_cast<int>(positions.cols()); }
  bool along_direction(int datum) const {
    return directions.cols() > 0 && !directions.col(datum).isZero(0.0);
  }
  // Scalar measurements: 3 per whole displacement, 1 per datum along a direction.
  int rows() const;
};

// Data of several sources as one: counts and common errors add up, errors of different sources are independent.
SparseData combine(const std::vector<SparseData>& parts);

}  // namespace brainshift
