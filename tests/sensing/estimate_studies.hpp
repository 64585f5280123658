// SPDX-License-Identifier: GPL-3.0-or-later
// Studies of estimates from sensed data, on the default head. Each records its figures. It returns
// an error only when it cannot measure.
#pragma once

#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::sensing {

// Tumour boundary and exposed cortex together, against the tumour alone.
Status joint_study(const bench::Head& head);
// The tumour's boundary as distances, against its rigid alignment: figures without a bound.
Status boundary_study(const bench::Head& head);
// Fifteen landmark pairs, one of them left out, against the best rigid fit.
Status landmark_study(const bench::Head& head);
// Gross outliers among boundary points and among landmark pairs.
Status outlier_study(const bench::Head& head);

}  // namespace brainshift::sensing
