// SPDX-License-Identifier: GPL-3.0-or-later
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
#pragma once

#include <functional>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/fem/elasticity.hpp"

namespace brainshift::fem {

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

}  // namespace brainshift::fem
