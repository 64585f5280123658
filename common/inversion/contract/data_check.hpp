// SPDX-License-Identifier: GPL-3.0-or-later
// Is this SparseData fit to be inverted? Every inversion checks its data here, whatever brought
// them: this is the one place where numbers that enter an inversion are tested for being finite.
#pragma once

#include "common/core/error.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// Positions whose second principal spread is below this fraction of the first count as collinear,
// those whose third is, as coplanar: rotation about their line, or strain across their plane, would
// be left to the prior alone.
inline constexpr double kCollinearRatio = 1e-6;
// Two data contradict each other when their displacements differ by more than
//   kContradiction_mm + kContradictionStretch |x_i - x_j| + kContradictionSds (sd_i + sd_j)
// Tissue at one place does not tear by 15 mm, nor stretch to three times its length, and four
// standard deviations of each datum are noise.
inline constexpr double kContradiction_mm = 15.0;
inline constexpr double kContradictionStretch = 2.0;
inline constexpr double kContradictionSds = 4.0;
// Boundary points may lie outside a mesh that cuts corners. Farther out than this is not the brain.
inline constexpr double kOutsideTolerance_mm = 5.0;

// A direction is a unit vector to this accuracy.
inline constexpr double kUnitTolerance = 1e-6;

// Ok, or the first of: kInvalidArgument (sizes differ, sources that do not cover the data one after
// the other, directions that are neither zero nor unit vectors, fewer than 3 data, sd <= 0,
// collinear or coplanar positions, neighbours that contradict each other), kNotFinite. The sentence
// names the datum.
Status check_data(const SparseData& data);

// kInvalidArgument when a datum is along a direction: methods other than condensed take whole
// displacements only.
Status check_whole(const SparseData& data);

}  // namespace brainshift::inversion
