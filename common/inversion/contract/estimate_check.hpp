// SPDX-License-Identifier: GPL-3.0-or-later
// What an estimate is held to before anyone sees it.
//
//   finite        displacement and forces                                         kNotFinite
//   equilibrium   P_i = 0p_i - N_i . u_i of the rebuilt field against the P_i that contact was solved with, at every
//                 slave: field, forces and modes belong together                  kNotConverged
//   upright       elements with det F <= 0 are counted (fem/deformation.hpp)      said in the reason
//   locking       P1 above kLockingPoissonRatio                                   said in the reason
//
// The equilibrium of the body itself, K u = b + N f, holds for every sum of columns that each were solved right
// (fem/checked_solve.hpp, when they were prepared); contact is what an update solves anew.
// All of it costs less than 3 % of an update (tests/benchmarks/bench_guards.cpp).
#pragma once

#include <string>
#include <vector>

#include "common/values/condensed_operators.hpp"
#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/fem/deformation.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::inversion {

// Two ways to the same penetration: in double at the slaves, and by the rebuilt field, a sum of single-precision
// columns, 6e-8 each of terms that cancel. No point of `make stability` was refused for it.
inline constexpr double kEquilibriumTolerance_mm = 1e-3;
inline constexpr double kEquilibriumRelative = 2e-5;

// penetration: one per slave, as contact was solved. slaves: which of them are looked at.
Status check_equilibrium(const CondensedOperators& operators, const std::vector<int>& slaves,
                         const VecX& penetration, const Points& displacement);

// Fills what the estimate says of its elements. kNotFinite when the displacement is not finite.
Status check_deformation(const fem::Deformation& deformation, Estimate& estimate);

// Appends one clause per warning: inverted elements, locking. Allocates only where the reason has to grow.
void append_warnings(const Estimate& estimate, double poisson_ratio, std::string& reason);

// All but equilibrium, for methods that are in no hurry.
Status check_estimate(const PreparedModel& model, Estimate& estimate);

}  // namespace brainshift::inversion
