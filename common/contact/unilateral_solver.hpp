// SPDX-License-Identifier: GPL-3.0-or-later
// Elastic equilibrium with SurfaceContact: the minimum of 1/2 u.Ku - f.u + E_c(u) under
// prescribed displacements.
//
// Semi-smooth Newton: solve for the active set, take the points that penetrate as the next one,
// stop when a set repeats. The energy is convex and piecewise quadratic, so with an exact line
// search towards each Newton point the method descends from any start; without it, sets can
// cycle. The first set holds the points that touch, so that a body that only its obstacle holds
// has support from the first solve.
#pragma once

#include "common/contact/surface_contact.hpp"
#include "common/core/progress.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/linalg/cholesky.hpp"

namespace brainshift::contact {

struct UnilateralSolution {
  Points displacement;  // 3 x n, mm
  ActiveSet active;     // of the contact points
  int iterations = 0;   // linear solves with a set of their own
  double rcond = 0.0;
  // |b - K u| / |b| of the last solve, after one step of refinement.
  double relative_residual = 0.0;
};

struct UnilateralOptions {
  int max_iterations = 60;
  double touching_mm = 1e-9;  // a gap below this counts as touching at the start
};

// stiffness: K of the constrained unknowns (lower); load: f - K lift, 3 x n nodal.
// kNotConverged: max_iterations reached. kFloatingBody: no contact is left that holds the body.
// Otherwise errors as SparseCholesky.
Result<UnilateralSolution> solve_unilateral(const linalg::SymmetricMatrix& stiffness,
                                            const fem::ConstrainedDofs& constrained,
                                            const SurfaceContact& contact, const Points& load,
                                            const UnilateralOptions& options = {},
                                            const Progress& progress = {});

}  // namespace brainshift::contact
