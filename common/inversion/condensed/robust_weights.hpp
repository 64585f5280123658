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
// Two data at one place that contradict each other are named by contradictions.hpp.
#pragma once

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

}  // namespace brainshift::inversion
