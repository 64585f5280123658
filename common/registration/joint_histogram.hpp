// SPDX-License-Identifier: GPL-3.0-or-later
// Joint distribution of two intensities and their normalised mutual information.
//
//   p(a, b) = 1/n sum_i L(a - s_i) B(b - m_i),   s_i, m_i: intensities of sample i in bins
//   NMI = (H(A) + H(B)) / H(A, B),               H = - sum p log p
// L: linear window (two bins). B: cubic B-spline (four bins), so that p and NMI have continuous
// derivatives in m_i.
// NMI is 1 for independent intensities and 2 where each determines the other. It does not depend
// on the units of either.
// Sources: Studholme, Hill & Hawkes, "An overlap invariant entropy measure of 3D medical image
// alignment", Pattern Recognition 32 (1999); B-spline window: Thevenaz & Unser, IEEE TIP 9 (2000).
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift::registration {

// Linear map of an intensity range to bin positions. Values outside the range fall on its ends.
// One bin at the low end and two at the high end stay free for the windows' tails.
// Precondition: bins > 4 and high > low.
struct BinScale {
  double low = 0.0, high = 1.0;
  int bins = 32;

  double bins_per_unit() const { return (bins - 4) / (high - low); }
  // In [1, bins - 3].
  double position(double intensity) const;
};

// The range between two quantiles (0 to 1) of the values. Precondition: at least one value. When
// all values between the quantiles are equal, high == low.
BinScale quantile_scale(const VecX& values, double low_quantile, double high_quantile, int bins);

class JointHistogram {
 public:
  explicit JointHistogram(int bins);

  void clear();
  // s, m: bin positions in [1, bins - 3].
  void add(double s, double m);
  // NMI of what was added since clear(); 0 when the distribution is concentrated in one bin or
  // nothing was added. Call it once per clear(): it scales the counts.
  double nmi();
  // d NMI / d m of one of the samples that were added, per bin. Call it after nmi().
  double derivative(double s, double m) const;

 private:
  int bins_;
  double count_ = 0.0;
  Eigen::MatrixXd p_;      // rows: m; columns: s
  Eigen::MatrixXd slope_;  // d NMI / d p, up to a constant
};

}  // namespace brainshift::registration
