// SPDX-License-Identifier: Apache-2.0
// Vocabulary types shared by every stage.
//
// Frame: patient RAS in millimetres, everywhere. Transforms are named T_target_source and
// left-multiply: x_target = T_target_source * x_source. A displacement u moves an undeformed
// point to its deformed place ("modelling" direction). Internal units: mm, N, s (stress N/mm^2 =
// MPa).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace brainshift {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using VecX = Eigen::VectorXd;

// 3 x n, one point (or vector) per column.
using Points = Eigen::Matrix3Xd;

// Index of a mesh node, 0-based.
using NodeIndex = int;

// Rigid motion; rotation() orthonormal with determinant +1.
using RigidTransform = Eigen::Isometry3d;
using AffineTransform = Eigen::Affine3d;

// The name of an enumerator: `names` has them all in their order, up to that of kLast.
template <auto kLast, std::size_t N>
constexpr std::string_view enum_name(decltype(kLast) value, const std::string_view (&names)[N]) {
  static_assert(N == static_cast<std::size_t>(kLast) + 1, "a name for every enumerator");
  const auto number = static_cast<std::size_t>(value);
  return number < N ? names[number] : std::string_view("unknown");
}

}  // namespace brainshift
