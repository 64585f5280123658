// SPDX-License-Identifier: GPL-3.0-or-later
// Gravity and buoyancy (paper eq. 1 right-hand side and section 2.6).
//
// The body force on tissue is (rho_t - rho_f) g per volume, along gravity. rho_f is the density
// of the surrounding fluid: rho_saturated below the fluid plane, rho_unsaturated above it. With
// Table 1 the tissue is weightless below the plane and carries its full weight above it. A fluid
// plane that has sunk (drainage) makes the brain sag.
#pragma once

#include <functional>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/fem/elasticity.hpp"

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

// Stress-free strain and initial stress of tissue, as loads.
//
// Tissue that takes up water (oedema) or loses it (mannitol) changes its volume by the strain theta
// if nothing holds it. The stress-free strain is e0 = theta / 3 I, and sigma = C (e - e0) = C e -
// kappa theta I with the drained bulk modulus kappa = lambda + 2 G / 3. An initial stress sigma0
// moves to the right-hand side:
//
//   f = - int B^T sigma0 dV,     per tetrahedron and node i:  f_i = - V sigma0 g_i
//
// with g_i the gradient of the shape function; swelling is sigma0 = - kappa theta I. The forces
// balance: no net force, and no net moment as sigma0 is symmetric. A free body with constant theta
// follows with u = theta / 3 x.

// strain: theta at a tetrahedron's centroid (mm). of_tet: one material per tetrahedron. Nodal
// forces f, 3 x n, N.
Points swelling_load(const TetMesh& mesh, const std::vector<Elasticity>& of_tet,
                     const std::function<double(const Vec3&)>& strain);
// One material for the whole mesh.
Points swelling_load(const TetMesh& mesh, const Material& material,
                     const std::function<double(const Vec3&)>& strain);

// On linear or quadratic elements, theta at the points of fem::fine_tet_rule:
//   f_i = int kappa theta g_i dV
Points swelling_load(const DisplacementSpace& space, const Material& material,
                     const std::function<double(const Vec3&)>& strain);

// stress: symmetric sigma0 at a tetrahedron's centroid (mm), N/mm^2, pull positive. Nodal forces,
// 3 x n, N.
Points initial_stress_load(const TetMesh& mesh, const std::function<Mat3(const Vec3&)>& stress);

// Pressure p (per triangle, at its centre, mm) on a wall whose triangles look out of the tissue, a
// third of a triangle's force at each of its nodes; pressing the tissue where p > 0. Unit: that of
// p times mm^2. 3 x n.
Points wall_pressure_load(const Points& nodes, const Eigen::Matrix<int, 3, Eigen::Dynamic>& wall,
                          const std::function<double(const Vec3&)>& pressure);

}  // namespace brainshift::fem
