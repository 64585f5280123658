// SPDX-License-Identifier: Apache-2.0
// SparseData: displacements at points of the undeformed brain; the d of the paper's eq. 4.
//
//   d = A u + common_error c + e,   c ~ N(0, I),   e ~ N(0, diag(sd^2))
// A datum is a whole displacement (three components) or, with a direction n, the part of it along
// n: a distance to a measured surface tells nothing about sliding along that surface.
//
// Assumptions: errors are zero-mean and Gaussian. e is isotropic and independent from datum to
// datum. An error that several data share, for example a misalignment, is in common_error.
// How large some of them are, and over which length they vary, may not be known: c ~ N(0,
// diag(v_e)) under hypothesis e of kOutlineErrors. Methods that know independent errors only, such
// as the paper's, ignore common_error.
#pragma once

#include <array>
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

// What neighbours on an outline may be off by alike along the normal, mm: standard deviation and
// length, none first and the shortest length before others (docs/decisions/0039).
struct OutlineError {
  double sd_mm, length_mm;
};
inline constexpr std::array<OutlineError, 7> kOutlineErrors = {
    {{0.0, 5.0}, {0.125, 5.0}, {0.25, 5.0}, {0.5, 5.0}, {0.125, 10.0}, {0.25, 10.0}, {0.5, 10.0}}};

struct SparseData {
  Points positions;      // 3 x m, undeformed, mm RAS
  Points displacements;  // 3 x m, mm; along a direction: (n . d) n
  VecX sd_mm;            // m, standard deviation per component
  // 3m x q, mm, q <= kMaxCommonErrors; row 3 i + axis belongs to datum i. No rows: no such error.
  Eigen::MatrixXd common_error = {};
  // q x h, 0 to 1: the variance of c under each of the first h of kOutlineErrors. h = 0: 1.
  Eigen::MatrixXd common_variance = {};
  // 3 x m: per datum a unit vector, or zero for a whole displacement. No columns: all are whole.
  Points directions = {};
  // In the order of the data; each datum belongs to one source. Empty: one source without a name.
  std::vector<DataSource> sources = {};

  // An alignment has 12 common errors, a camera 6 and an outline up to 25: this is enough for the
  // sources of a room.
  static constexpr int kMaxCommonErrors = 160;

  int size() const { return static_cast<int>(positions.cols()); }
  bool along_direction(int datum) const {
    return directions.cols() > 0 && !directions.col(datum).isZero(0.0);
  }
  // Scalar measurements: 3 per whole displacement, 1 per datum along a direction.
  int rows() const;
};

// Joins sources: rows and common errors are concatenated, independent between sources. Of one with
// fewer error hypotheses than another the rest have the same size and its longest length.
SparseData combine(const std::vector<SparseData>& parts);

}  // namespace brainshift
