// SPDX-License-Identifier: Apache-2.0
// Sample statistics used by scores, reports and benchmarks.
#pragma once

#include <span>

#include "common/core/types.hpp"

namespace brainshift {

// Mean and sample standard deviation (n-1). Mean of no value: 0. Deviation of fewer than two: 0.
struct MeanStd {
  double mean = 0.0;
  double std = 0.0;
};

MeanStd mean_std(std::span<const double> values);

// Mean and standard deviation of the lengths of the columns.
MeanStd mean_std_of_norms(const Points& vectors);

// Percentile by linear interpolation between order statistics; q in [0, 100]. Empty input: NaN.
double percentile(std::span<const double> values, double q);

}  // namespace brainshift
