// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/full_solve.hpp"

#include <vector>

#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"

namespace brainshift::contact {

double measure_full_solve_ms(const ForwardModel& forward) {
  constexpr int kRepetitions = 9;
  const VecX b = VecX::LinSpaced(forward.dofs().num_unknowns(), -1.0, 1.0);
  VecX x = forward.factor().solve(b);  // allocates the workspace
  std::vector<double> times_ms;
  for (int i = 0; i < kRepetitions; ++i) {
    const Stopwatch watch;
    forward.factor().solve(b, x);
    times_ms.push_back(watch.milliseconds());
  }
  return percentile(times_ms, 50.0);
}

}  // namespace brainshift::contact
