// SPDX-License-Identifier: Apache-2.0
// SparseData: displacements at points of the undeformed brain; the d of the paper's eq. 4.
//
//   d = A u + common_error c + e,   c ~ N(0, I),   e ~ N(0, diag(sd^2))
// A datum is a whole displacement (three components) or, with a direction n, the part of it along
// n: a distance to a measured surface tells nothing about sliding along that surface.
//
// Assumptions: errors are zero-mean and Gaussian. e is isotropic and independent from datum to
// datum. An error that several data share, for example a misalignment, is in common_error.
// Methods that know independent errors only, such as the paper's, ignore common_error.
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
  // 3m x q, mm, q <= kMaxCommonErrors; row 3 i + axis belongs to datum i. No rows: no such error.
  Eigen::MatrixXd common_error = {};
  // 3 x m: per datum a unit vector, or zero for a whole displacement. No columns: all are whole.
  Points directions = {};
  // In the order of the data; each datum belongs to one source. Empty: one source without a name.
  std::vector<DataSource> sources = {};

  // An alignment has 12 common errors and a camera 6: this is enough for the sources of a room.
  static constexpr int kMaxCommonErrors = 48;

  int size() const { return static_cast<int>(positions.cols()); }
  bool along_direction(int datum) const {
    return directions.cols() > 0 && !directions.col(datum).isZero(0.0);
  }
  // Scalar measurements: 3 per whole displacement, 1 per datum along a direction.
  int rows() const;
};

// Joins the data of several sources. Rows and common errors are concatenated: errors of different
// sources are independent.
SparseData combine(const std::vector<SparseData>& parts);

}  // namespace brainshift
