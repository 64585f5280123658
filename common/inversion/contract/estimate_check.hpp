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
#include "common/core/types.hpp"
#include "common/fem/deformation.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

// How far slaves stand in the skull, in the numbers that an iteration record and an estimate carry.

// A slave counts as penetrating when it is deeper than this: a hundredth of the 1 mm gap. Penalty
// contact leaves force / beta, some micrometres, at every slave that carries a force.
inline constexpr double kPenetrationTolerance_mm = 0.01;

struct PenetrationSummary {
  int penetrating = 0;  // slaves above the tolerance
  double max_mm = 0.0;  // 0 when no slave penetrates
};

// penetration: one per slave, mm, negative where the slave is open.
inline PenetrationSummary summarise_penetration(const VecX& penetration) {
  PenetrationSummary summary;
  for (const double depth_mm : penetration) {
    if (depth_mm > kPenetrationTolerance_mm) ++summary.penetrating;
    if (depth_mm > summary.max_mm) summary.max_mm = depth_mm;
  }
  return summary;
}

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

// The verdict on an estimate (common/values/quality.hpp), for every method: Inverter::update() asks
// for it once per estimate.
//
// Each flag follows from members of the estimate. What a method does not compute sets no flag:
// misfit_ratio, contact.decrement, contact.max_violation_mm and the volume ratios may be NaN for
// "not computed". A number that is infinite, or NaN elsewhere, sets kNotFinite. Motion beyond the
// skull is measured in two ways:
//
//   motion   max_i |u_i| over all nodes                       above kMaxMotion_mm
//   depth    contact.max_penetration_mm, over the slaves      above kDeepestInSkull_mm
//
// An element that is inverted sets kInvertedElements and not kVolumeLost. min_nodal_volume_ratio
// judges a loss of volume.

// Never kNotJudged. O(nodes), some microseconds for a head. Writes into the memory that `verdict`
// has, and allocates only where its reason has to grow.
void judge(const Estimate& estimate, QualityVerdict& verdict);

}  // namespace brainshift::inversion
