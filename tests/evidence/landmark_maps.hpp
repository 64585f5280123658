// SPDX-License-Identifier: GPL-3.0-or-later
// Maps from places before surgery to places during it that need no model of the brain, fitted to
// pairs (x_i, y_i) of landmarks. What an estimate is held against.
//
//   rigid        y = R x + t       least squares (registration/fiducials.hpp)
//   affine       y = A x + t       least squares
//   thin plate   y = A x + t + sum_i w_i |x - x_i|,  sum_i w_i = 0,  sum_i w_i x_i^T = 0
//                through every pair, with the least bending energy in space (Bookstein 1989, IEEE
//                TPAMI 11:567; the kernel of three dimensions is |x|)
#pragma once

#include <functional>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::evidence {

using PointMap = std::function<Vec3(const Vec3&)>;

// before, during: 3 x n, mm. Errors of register_fiducials.
Result<PointMap> rigid_map(const Points& before, const Points& during);
// kInvalidArgument when the numbers differ, below 4, or when all lie in one plane.
Result<PointMap> affine_map(const Points& before, const Points& during);
// The same; kInvalidArgument also when two places before surgery are one.
Result<PointMap> thin_plate_map(const Points& before, const Points& during);

}  // namespace brainshift::evidence
