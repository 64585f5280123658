// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/paired_test.hpp"

#include <cassert>
#include <cmath>
#include <vector>

#include "common/core/statistics.hpp"

namespace brainshift::bench {
namespace {

// The continued fraction of I_x(a, b), which converges fast for x < (a + 1) / (a + b + 2).
double beta_fraction(double a, double b, double x) {
  constexpr int kTerms = 500;
  constexpr double kTiny = 1e-300, kSettled = 1e-15;
  const auto kept = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
  double c = 1.0, d = 1.0 / kept(1.0 - (a + b) * x / (a + 1.0));
  double value = d;
  for (int m = 1; m <= kTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    for (const double term : {even, odd}) {
      d = 1.0 / kept(1.0 + term * d);
      c = kept(1.0 + term / c);
      value *= c * d;
    }
    if (std::abs(c * d - 1.0) < kSettled) break;
  }
  return value;
}

}  // namespace

double incomplete_beta(double a, double b, double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1.0) / (a + b + 2.0)) return front * beta_fraction(a, b, x) / a;
  return 1.0 - front * beta_fraction(b, a, 1.0 - x) / b;
}

PairedTest paired_t_test(std::span<const double> a, std::span<const double> b) {
  assert(a.size() == b.size());
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double difference = a[i] - b[i];
    if (std::isfinite(difference)) differences.push_back(difference);
  }
  PairedTest test;
  test.pairs = static_cast<int>(differences.size());
  const MeanStd of = mean_std(differences);
  test.mean = of.mean;
  if (test.pairs < 2 || of.mean == 0.0) return test;
  test.t = of.mean / (of.std / std::sqrt(static_cast<double>(test.pairs)));
  const double freedom = test.pairs - 1;
  test.p = std::isfinite(test.t)
               ? incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + test.t * test.t))
               : 0.0;
  return test;
}

}  // namespace brainshift::bench
