// SPDX-License-Identifier: GPL-3.0-or-later
// Gravity and buoyancy (paper eq. 1 right-hand side and section 2.6).
//
// The body force on tissue is (rho_t - rho_f) g per volume, along gravity. rho_f is the density
// of the surrounding fluid: rho_saturated below the fluid plane, rho_unsaturated above it. With
// Table 1 the tissue is weightless below the plane and carries its full weight above it. A fluid
// plane that has sunk (drainage) makes the brain sag.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/displacement_space.hpp"

namespace brainshift::fem {

// Consistent nodal forces (N), 3 x n: a quarter of each element's volume times its body force. Of
// an element that the plane cuts, the part above the plane counts as unsaturated (depth linear in
// the element, exact volume fraction). Depth of x: x . gravity_direction; above the plane the
// depth is less than plane_depth_mm.
// force_direction: unit vector of the force, gravity_direction itself or another axis for prior
// modes.
Points buoyancy_load(const TetMesh& mesh, const Material& material, const Vec3& gravity_direction,
                     double plane_depth_mm, const Vec3& force_direction);

// On linear or quadratic elements; of an element that the plane cuts, each point of
// fem::fine_tet_rule counts as above or below.
Points buoyancy_load(const DisplacementSpace& space, const Material& material,
                     const Vec3& gravity_direction, double plane_depth_mm);

// Volume fraction of a tetrahedron in which the linear function with these nodal values is
// negative; in [0, 1].
double negative_volume_fraction(const Eigen::Vector4d& values);

}  // namespace brainshift::fem
