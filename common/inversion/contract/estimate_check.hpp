// SPDX-License-Identifier: GPL-3.0-or-later
// What an estimate must hold before anyone sees it.
//
//   finite        displacement and forces                                         kNotFinite
//   equilibrium   P_i = 0p_i - N_i . u_i of the rebuilt field against the P_i that contact was
//                 solved with, at every slave: field, forces and modes belong together
//                                                                                 kNotConverged
//   upright       elements with det F <= 0 (fem/deformation.hpp)           counted in the reason
//   locking       P1 above kLockingPoissonRatio                            named in the reason
//
// The equilibrium of the body itself, K u = b + N f, follows from the columns, each of which was
// solved with a check (linalg/checked_solve.hpp) before surgery. Contact is what an update solves
// anew. All of it costs less than 3 % of an update (tests/benchmarks/bench_guards.cpp).
#pragma once

#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/deformation.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

// Two ways to the same penetration: in double at the slaves, and by the rebuilt field, a sum of
// compact columns in single precision with 6e-8 of rounding in each of the terms, which cancel.
// `make stability` has no point that fails this.
inline constexpr double kEquilibriumTolerance_mm = 1e-3;
inline constexpr double kEquilibriumRelative = 2e-5;

// penetration: one per slave, as contact was solved. slaves: indices of the slaves to look at.
Status check_equilibrium(const CondensedOperators& operators, const std::vector<int>& slaves,
                         const VecX& penetration, const Points& displacement);

// Fills both volume ratios and inverted_elements. kNotFinite when the displacement is not finite.
Status check_deformation(const fem::Deformation& deformation, Estimate& estimate);

// Appends one clause per warning: inverted elements, locking. Allocates only where the reason has
// to grow.
void append_warnings(const Estimate& estimate, double poisson_ratio, std::string& reason);

// All but equilibrium, for methods without condensed operators: the other two functions, with the
// deformation measured here.
Status check_estimate(const TetMesh& mesh, const Material& material, Estimate& estimate);

}  // namespace brainshift::inversion
