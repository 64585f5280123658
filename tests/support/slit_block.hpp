// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks on either side of a slit with a fixed sheet, for tests of the contact with falx and
// tentorium and for the same problem in CalculiX (tests/evidence/calculix/slit.inp).
//
// The box [0, 60] x [0, 30] x [0, 30] mm, cut in the plane x = 30 from z = `from_mm` up; below, the
// two sides are one body. The faces x = 0, x = 60, y = 0 and z = 0 slide on rollers, the others are
// free. Linear elastic, G = 2100 Pa, nu = 0.4; penalty 1e6 N/mm at each of the slit's nodes.
#pragma once

#include <array>
#include <vector>

#include "common/contact/forward_model.hpp"

namespace brainshift::test_support {

inline constexpr double kSlitPlane_mm = 30.0, kSlitPoisson = 0.4, kSlitPenalty = 1e6;
inline constexpr double kSlitShear = 2100e-6;  // N/mm^2

// cells: along x, y and z; those along x even. gap_mm: between each side and its sheet's face.
BrainModel slit_block(const std::array<int, 3>& cells, double gap_mm, double from_mm = 0.0);

// On which side of the plane a node's tissue is: -1 left, 1 right. Where both meet, either.
std::vector<int> sides_of(const TetMesh& mesh);

// The degrees of freedom that rollers hold.
bool on_roller(const Vec3& node, int axis);
Result<contact::ForwardModel> on_rollers(const BrainModel& model);

// Displacement under the load with its contact. kNotConverged: not within 50 sets.
Result<Points> equilibrium(const contact::ForwardModel& forward, const Points& load);

// The problem that CalculiX solves too: a slit from z = 10 mm up with gaps of 0.2 mm, 8 x 6 x 6
// cells. Everything sinks. The left side is pushed onto the sheet for y < 15 mm and drawn off it
// beyond, the right side pushed onto it for z < 20 mm and drawn off it above.
BrainModel partly_slit_block();
Points load_of_partly_slit_block(const TetMesh& mesh);  // 3 x n, N

}  // namespace brainshift::test_support
