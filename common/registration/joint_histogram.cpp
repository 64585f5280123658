// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/joint_histogram.hpp"

#include <algorithm>
#include <cmath>

namespace brainshift::registration {
namespace {

// Weights of the cubic B-spline at bins floor(m) - 1 .. floor(m) + 2, and their derivatives by m.
struct SplineWindow {
  int first = 0;
  Eigen::Vector4d weight, slope;
};

SplineWindow spline_window(double m) {
  const double floor = std::floor(m);
  const double t = m - floor, u = 1.0 - t;
  SplineWindow window;
  window.first = static_cast<int>(floor) - 1;
  window.weight << u * u * u / 6.0, 2.0 / 3.0 - t * t + 0.5 * t * t * t,
      2.0 / 3.0 - u * u + 0.5 * u * u * u, t * t * t / 6.0;
  window.slope << -0.5 * u * u, -2.0 * t + 1.5 * t * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t;
  return window;
}

double plogp(double p) { return p > 0.0 ? p * std::log(p) : 0.0; }

double entropy(const VecX& p) {
  double sum = 0.0;
  for (double value : p) sum -= plogp(value);
  return sum;
}

}  // namespace

double BinScale::position(double intensity) const {
  return 1.0 + (std::clamp(intensity, low, high) - low) * bins_per_unit();
}

BinScale quantile_scale(const VecX& values, double low_quantile, double high_quantile, int bins) {
  std::vector<double> sorted(values.begin(), values.end());
  const auto at = [&sorted](double quantile) {
    const auto rank =
        static_cast<std::ptrdiff_t>(quantile * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
    return sorted[static_cast<std::size_t>(rank)];
  };
  BinScale scale;
  scale.low = at(low_quantile);
  scale.high = at(high_quantile);
  scale.bins = bins;
  return scale;
}

JointHistogram::JointHistogram(int bins)
    : bins_(bins),
      p_(Eigen::MatrixXd::Zero(bins, bins)),
      slope_(Eigen::MatrixXd::Zero(bins, bins)) {}

void JointHistogram::clear() {
  p_.setZero();
  count_ = 0.0;
}

void JointHistogram::add(double s, double m) {
  const SplineWindow window = spline_window(m);
  const int column = static_cast<int>(s);
  const double t = s - column;
  p_.block<4, 1>(window.first, column) += (1.0 - t) * window.weight;
  p_.block<4, 1>(window.first, column + 1) += t * window.weight;
  count_ += 1.0;
}

// With F = (HA + HB) / HAB:  dF/dp(a,b) = (F (log p(a,b) + 1) - log pA(a) - log pB(b) - 2) / HAB.
// A term that is equal for all bins has no effect, since the sum of p does not change.
double JointHistogram::nmi() {
  slope_.setZero();
  if (count_ == 0.0) return 0.0;
  p_ /= count_;
  const VecX of_m = p_.rowwise().sum(), of_s = p_.colwise().sum();
  double joint = 0.0;
  for (double value : p_.reshaped()) joint -= plogp(value);
  if (!(joint > 0.0)) return 0.0;
  const double nmi = (entropy(of_m) + entropy(of_s)) / joint;
  for (int a = 0; a < bins_; ++a)
    for (int b = 0; b < bins_; ++b)
      if (p_(b, a) > 0.0)
        slope_(b, a) =
            (nmi * std::log(p_(b, a)) - std::log(of_s[a]) - std::log(of_m[b])) / (joint * count_);
  return nmi;
}

double JointHistogram::derivative(double s, double m) const {
  const SplineWindow window = spline_window(m);
  const int column = static_cast<int>(s);
  const double t = s - column;
  return (1.0 - t) * window.slope.dot(slope_.block<4, 1>(window.first, column)) +
         t * window.slope.dot(slope_.block<4, 1>(window.first, column + 1));
}

}  // namespace brainshift::registration
