// SPDX-License-Identifier: GPL-3.0-or-later
// Small rigid motions about a centre c, and how a distance changes with them.
//
//   T(xi) x = c + exp([w]x) (x - c) + t,      xi = (w, t): rotation vector (rad), translation (mm)
//   d/dxi  n . T(xi) x  at xi = 0   =   ((x - c) x n,  n)
#pragma once

#include "common/core/small_matrices.hpp"

namespace brainshift::registration {

// T(xi), mm.
RigidTransform rigid_increment(const Vec6& xi, const Vec3& centre);

// Rotation vector w with exp([w]x) = rotation, |w| <= pi.
Vec3 rotation_vector(const Mat3& rotation);

// Gradient of n . T(xi) x at xi = 0, for a fixed direction n: mm per radian, and no unit.
Vec6 direction_gradient(const Vec3& x, const Vec3& n, const Vec3& centre);

}  // namespace brainshift::registration
