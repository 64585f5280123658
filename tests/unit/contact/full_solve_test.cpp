// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/full_solve.hpp"

#include "common/core/stopwatch.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::contact {
namespace {

TEST(FullSolve, IsPositiveAndShorterThanAllItsSolvesTogether) {
  const auto model = inversion::prepare(Boundary::kContact);
  const Stopwatch watch;
  const double solve_ms = measure_full_solve_ms(model.forward());
  EXPECT_GT(solve_ms, 0.0);
  EXPECT_LT(5.0 * solve_ms, watch.milliseconds());  // 5 of its 9 solves take the median or more
}

}  // namespace
}  // namespace brainshift::contact
