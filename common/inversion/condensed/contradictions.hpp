// SPDX-License-Identifier: GPL-3.0-or-later
// Contradictions: two data at one place that cannot both be right, whatever prior and contact are.
//
//   e     part of d_j - d_i that both data measure: all of it, or its part along n_i or n_j
//   t     |e| - kContradictionStretch |x_j - x_i|: what tissue between the two cannot explain
//   s^2   sd_i^2 + sd_j^2 + |C_j - C_i|_F^2 / 3, C the common error: what both share cancels;
//         along a direction n, sum over the columns of (n . (C_j - C_i))^2 in place of the last
//   contradiction   |x_j - x_i| <= kOnePlace_mm  and  t > c s,  c = kOutlierWhole or kOutlierAlong
//
// The estimate alone does not show a contradiction. With full weights the posterior mean takes the
// middle of the two data, and the misfit ratio averages the pair over all data. With robust weights
// the estimate follows the datum that the neighbours support, and the misfit ratio stays at 1.
// One of the two data is wrong either way, so the pair is named. Two data along directions that are
// not parallel measure different parts and are not compared.
//
// Cost: one sort, and the pairs whose first coordinates differ by at most kOnePlace_mm.
#pragma once

#include <string>
#include <vector>

#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// About the accuracy of place of a pointer or a camera, and a fifth of the default correlation
// length of the prior, which cannot tell the displacements of such data apart.
inline constexpr double kOnePlace_mm = 1.0;
// |n_i . n_j| from which two directions measure the same part, 2.6 degrees.
inline constexpr double kParallel = 0.999;

struct Contradiction {
  int first = -1;  // data, first < second; -1: there is none
  int second = -1;
  double differ_mm = 0.0;  // |e|
  double sds = 0.0;        // t / s
  int pairs = 0;           // contradictions found; this one has the largest t / s of them
};

// Appends the clause that names the pair, with its place (mm RAS); nothing when there is none.
void append_contradiction(const Contradiction& found, const SparseData& data, std::string& reason);

class Contradictions {
 public:
  void reserve(int data);
  // Precondition: data that passed check_data(). Allocates nothing while the data fit what was
  // reserved.
  Contradiction find(const SparseData& data);

 private:
  std::vector<int> order_;  // by first coordinate
};

}  // namespace brainshift::inversion
