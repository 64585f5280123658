// SPDX-License-Identifier: GPL-3.0-or-later
// The time-dependent side of forward::solve, and what both sides share; private to forward.
#pragma once

#include "common/core/progress.hpp"
#include "common/forward/forward_problem.hpp"

namespace brainshift::forward {

// Biot consolidation from rest by backward Euler, problem.steps_s long each (fem/biot.hpp). Element P1, no contacts.
// A material that neither lets fluid through nor stores it is allowed: it stays undrained.
// relative_residual and rcond: the worst of all steps. Stress is the effective one, sigma + alpha p I of the total.
Result<ForwardSolution> consolidate(const ForwardProblem& problem, Discretised discretised,
                                    const Progress& progress);

// kFloatingBody when prescribed displacements leave a rigid motion free.
Status check_supports(const Discretised& discretised);
// What a reader of the solution should know: locking, inverted elements, a large residual, contact that never touches.
void add_warnings(const ForwardProblem& problem, ForwardSolution& solution);

}  // namespace brainshift::forward
