// SPDX-License-Identifier: GPL-3.0-or-later
// Gravity and buoyancy (paper eq. 1 right-hand side and section 2.6).
//
// The body force on tissue is (rho_t - rho_f) g, per volume, along gravity. rho_f is the density of the
// surrounding fluid: rho_saturated below the fluid plane, rho_unsaturated above it. With Table 1 the tissue
// is weightless below the plane and carries its full weight above it. A fluid plane that has sunk (drainage)
// is what makes a brain sag.
#pragma once

#include "common/values/case_config.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::fem {

// Consistent nodal forces (N), 3 x n: a quarter of each element's volume times its body force; an element cut
// by the plane counts with the part of its volume above the plane (linear interpolation of depth at its nodes,
// exact volume fraction). depth(x) = x . gravity_direction; above the plane means depth < plane_depth_mm.
// direction: unit vector of the force (gravity_direction itself, or another axis for prior modes).
Points buoyancy_load(const TetMesh& mesh, const Material& material, const Vec3& gravity_direction,
                     double plane_depth_mm, const Vec3& force_direction);

// Fraction of a tetrahedron's volume where the linear function with these nodal values is negative; in [0, 1].
double negative_volume_fraction(const Eigen::Vector4d& values);

}  // namespace brainshift::fem
