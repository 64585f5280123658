// SPDX-License-Identifier: GPL-3.0-or-later
// What leaving a part out may have changed: upper estimates of the greatest move of any node, mm,
// from numbers that an update has anyway. tests/unit/inversion/condensed/scene_test.cpp compares
// each with the true difference.
//
//   contact        kContactSafety * greatest ignored penetration. Contact pushes that slave back by
//                  it, so the true difference is about that much at least; the data then pull the
//                  modes after it.
//   gravity modes  one Newton step of the whole problem from the estimate without them, for the
//                  same active set and strengths of the prior:
//                    S dg = J_g^T r,  S = I + J_g^T J_g - C^T X,   dz = -X dg
//                    C = J^T J_g,     X = (S^-2 + J^T J)^-1 C
//                    du = (U_g - G_A T_g) dg + (U - G_A T) dz
//                  exact where the set stays; kGravitySafety times its greatest size at the control
//                  nodes. Where slaves would penetrate that the step leaves open, contact pushes
//                  back: kContactSafety times the greatest of these depths is added.
//   far field      field_rebuild.hpp
#pragma once

#include "common/core/error.hpp"
#include "common/inversion/condensed/field_rebuild.hpp"
#include "common/inversion/condensed/mode_posterior.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/skull/contact_reduction.hpp"

namespace brainshift::inversion {

// Measured: the true difference is at most 1.5 times the penetration and 1.22 times the step on the
// toy patient, 1.02 and 1.19 times on the default head where the set stays
// (tests/benchmarks/bench_scenes.cpp).
inline constexpr double kContactSafety = 2.0;
inline constexpr double kGravitySafety = 2.0;

// penetration: one per slave, mm.
double contact_error_mm(const VecX& penetration);

// posterior: of the reduction's set, with the answer of the update; penetration: of every slave
// there, mm. Allocates. Errors of ContactReduction::response_before.
Result<double> gravity_modes_error_mm(SampledOperators& sampled, const ContactReduction& contact,
                                      const FieldRebuild& rebuild, const ModePosterior& posterior,
                                      const VecX& penetration);

}  // namespace brainshift::inversion
