// SPDX-License-Identifier: Apache-2.0
// 4 x 4 matrices from files as motions: checks, and the nearest rigid motion. Lengths in mm.
#pragma once

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

// The largest entry of |R^T R - I| that a rotation written with three decimals may have: its
// entries are off by up to 5e-4, the product by up to 2 sqrt(3) 5e-4 = 1.7e-3. nearest_rigid then
// turns by up to 0.05 degrees, 0.1 mm at 100 mm.
constexpr double kThreeDecimals = 2e-3;

// Ok for a rigid motion: finite, last row 0 0 0 1, |R^T R - I| <= tolerance in every entry, det R
// > 0. kNotFinite, kInvalidArgument: "is no rigid motion: ...", without a file or name.
Status check_rigid(const Eigen::Matrix4d& matrix, double tolerance = kThreeDecimals);

// Ok for an invertible affine map: finite, last row 0 0 0 1, condition of the linear part at most
// 1e4.
Status check_affine(const Eigen::Matrix4d& matrix);

// The rigid motion nearest to a matrix that check_rigid accepts (polar decomposition); the
// translation stays.
RigidTransform nearest_rigid(const Eigen::Matrix4d& matrix);

}  // namespace brainshift
