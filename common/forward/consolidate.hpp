// SPDX-License-Identifier: GPL-3.0-or-later
// The time-dependent part of forward::solve, and what both parts share. Private to forward.
#pragma once

#include "common/core/progress.hpp"
#include "common/forward/forward_problem.hpp"

namespace brainshift::forward {

// Biot consolidation from rest by backward Euler with the step lengths problem.steps_s
// (fem/biot.hpp). Element P1, no contacts. A material that neither lets fluid through nor stores
// it is allowed: it stays undrained.
// relative_residual and rcond are the worst of all steps. Stress is the effective one: the total
// stress plus alpha p I.
Result<ForwardSolution> consolidate(const ForwardProblem& problem, Discretised discretised,
                                    const Progress& progress);

// kFloatingBody: the prescribed displacements leave a rigid motion free.
Status check_supports(const Discretised& discretised);
// Adds warnings that a reader of the solution should see: locking, inverted elements, a large
// residual, contact that never touches.
void add_warnings(const ForwardProblem& problem, ForwardSolution& solution);

}  // namespace brainshift::forward
