// SPDX-License-Identifier: GPL-3.0-or-later
// Robust weights: a datum counts less when chance and its source do not explain its residual.
//
//   r_i  whitened residual of datum i (3 rows, or 1 along a direction), without its weight
//   s    = max(1, median |r_i| / median of |N(0, I)|) over its source: what the model cannot
//          explain of a whole source is no reason to distrust single data
//   w_i  = 1 for |r_i| <= c s,  (c s / |r_i|)^4 beyond: the influence w r of a gross error vanishes
// A Gaussian residual exceeds c in one of some 20,000 data, so good data keep their full weight and
// the estimate is the posterior mean itself. The reason reports weights below kOutlierWeight as
// outliers. Iteratively reweighted least squares: Holland & Welsch 1977, Comm. Stat. A6:813.
// Two data at one place that contradict each other are named by Contradictions.
#pragma once

#include <string>
#include <vector>

#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// |N(0, I_k)| for k = 3 and k = 1: value exceeded once in 20,000 (a tail of 5e-5), and median.
inline constexpr double kOutlierWhole = 4.74;
inline constexpr double kOutlierAlong = 4.06;
inline constexpr double kMedianWhole = 1.5382;
inline constexpr double kMedianAlong = 0.67449;
// Below this weight a datum is counted as an outlier.
inline constexpr double kOutlierWeight = 0.5;
// Weights that change by less than this are settled.
inline constexpr double kWeightTolerance = 0.05;

class RobustWeights {
 public:
  void reserve(int data);
  // All ones.
  void reset(int data);
  // The data have been measured anew: a source of the same name and number of data keeps its
  // weights, wherever it stands now; all other data begin with 1. Data without sources count as
  // one source.
  void follow(const std::vector<DataSource>& before, const SparseData& now);
  auto values() const { return weights_.head(size_); }

  // norms: |r_i| with the present weight inside (sqrt(w) |r|), m. Returns true when a weight
  // changed by more than kWeightTolerance; otherwise all weights stay as they are, since the
  // caller's next norms will have them inside.
  bool update(const SparseData& data, const Eigen::Ref<const VecX>& norms);
  // Outliers among data [first, first + count).
  int outliers(int first, int count) const;

 private:
  double source_scale(const SparseData& data, int first, int count);
  VecX weights_, next_, residuals_;  // of the capacity
  int size_ = 0;
  std::vector<double> sorted_;
};

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
