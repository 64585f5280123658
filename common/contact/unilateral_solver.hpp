// SPDX-License-Identifier: GPL-3.0-or-later
// Elastic equilibrium with SurfaceContact: the minimum of 1/2 u.Ku - f.u + E_c(u) under prescribed displacements.
//
// Semi-smooth Newton: solve for the active set, take the points that penetrate as the next one, stop when a set
// repeats. The energy is convex and piecewise quadratic, so an exact line search towards each Newton point makes the
// method descend whatever the start; without it, sets can cycle. Starts from the points that touch, so that a body
// held by its obstacle alone has support from the first solve.
#pragma once

#include "common/contact/surface_contact.hpp"
#include "common/core/progress.hpp"
#include "common/linalg/cholesky.hpp"
#include "common/fem/displacement_constraints.hpp"

namespace brainshift::contact {

struct UnilateralSolution {
  Points displacement;  // 3 x n, mm
  ActiveSet active;     // of the contact points
  int iterations = 0;   // linear solves with a set of their own
  double rcond = 0.0;
  double relative_residual =
      0.0;  // |b - K u| / |b| of the last solve, after one step of refinement
};

struct UnilateralOptions {
  int max_iterations = 60;
  double touching_mm = 1e-9;  // a gap below this counts as touching at the start
  double hover = 1e-11;       // of the largest displacement: a penetration below it has no sign
};

// stiffness: K of the constrained unknowns (lower); load: f - K lift, 3 x n nodal. kNotConverged after
// max_iterations; kFloatingBody when the body comes loose; otherwise as SparseCholesky.
Result<UnilateralSolution> solve_unilateral(const linalg::SymmetricMatrix& stiffness,
                                            const fem::ConstrainedDofs& constrained,
                                            const SurfaceContact& contact, const Points& load,
                                            const UnilateralOptions& options = {},
                                            const Progress& progress = {});

}  // namespace brainshift::contact
