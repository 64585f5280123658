// SPDX-License-Identifier: GPL-3.0-or-later
// Student's paired t-test, as the paper compares boundary conditions with (section 2.8).
//
//   t = mean(d) / (sd(d) / sqrt(n)),   d_i = a_i - b_i,   n - 1 degrees of freedom
//   p = P(|T| >= |t|) = I_x(f / 2, 1 / 2),   x = f / (f + t^2),   f = n - 1
// I_x: regularised incomplete beta function, by its continued fraction (Lentz 1976).
#pragma once

#include <span>

namespace brainshift::bench {

struct PairedTest {
  int pairs = 0;
  double mean = 0.0;  // of a - b
  double t = 0.0;
  double p = 1.0;  // two-sided; 1 with fewer than two pairs or without a difference
};

// Pairs in which a number is not finite are left out. a and b have one length. Differences that are
// all alike and not 0: p = 0.
PairedTest paired_t_test(std::span<const double> a, std::span<const double> b);

// I_x(a, b) for a, b > 0 and x in [0, 1].
double incomplete_beta(double a, double b, double x);

}  // namespace brainshift::bench
