// SPDX-License-Identifier: GPL-3.0-or-later
// Drained elasticity on a DisplacementSpace, one material per region: stiffness, loads, stress.
//
//   K_ij = int [ lambda g_i g_j^T + G g_j g_i^T + G (g_i . g_j) I ] dV            3 x 3, N/mm
//   f_i  = int N_i b dV + int N_i t dA                                            N
//
// g_i: gradient of the shape function N_i. Stress is written xx yy zz xy yz xz, N/mm^2.
#pragma once

#include <functional>

#include "common/fem/displacement_space.hpp"
#include "common/fem/elasticity.hpp"

namespace brainshift::fem {

// A vector for each place, e.g. a body force (N/mm^3) or a traction (N/mm^2).
using VectorField = std::function<Vec3(const Vec3& x)>;
using Stress = Eigen::Matrix<double, 6, 1>;

// Lower triangle of T^T K T. The general form of assemble_stiffness in elasticity.hpp.
linalg::SymmetricMatrix assemble_stiffness(const DisplacementSpace& space,
                                           const MaterialMap& materials, const DofMap& dofs);

// K u element by element, without constraints: nodal forces that balance the stress of u. 3 x n.
Points internal_force(const DisplacementSpace& space, const MaterialMap& materials,
                      const Points& u);

// Consistent nodal forces, 3 x n. `density`: N/mm^3, one column per element, constant in it.
Points body_load(const DisplacementSpace& space, const Points& density);
Points body_load(const DisplacementSpace& space, const VectorField& density);
// Traction t (N/mm^2) on faces (3 x f vertices). Pressure p (N/mm^2) is the traction -p n, with n
// the outward normal by the orientation of the faces.
Points traction_load(const DisplacementSpace& space,
                     const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces,
                     const VectorField& traction);
Points pressure_load(const DisplacementSpace& space,
                     const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces, double pressure);

// Displacement gradient du_i/dx_j at a barycentric point of an element.
Mat3 displacement_gradient(const DisplacementSpace& space, const Points& u, int element,
                           const Eigen::Vector4d& l);
// Displacement there.
Vec3 displacement_at(const DisplacementSpace& space, const Points& u, int element,
                     const Eigen::Vector4d& l);
Stress stress_from(const Elasticity& material, const Mat3& gradient);
double von_mises(const Stress& stress);

// element_stress: at the centroids, 6 x m (the mean too, where stress is linear). nodal_stress:
// at the nodes, 6 x n, the mean of the adjacent elements' values there, weighted by volume,
// across regions too.
Eigen::MatrixXd element_stress(const DisplacementSpace& space, const MaterialMap& materials,
                               const Points& u);
Eigen::MatrixXd nodal_stress(const DisplacementSpace& space, const MaterialMap& materials,
                             const Points& u);
// Smallest det(I + grad u) over the elements' nodes and centroids. <= 0: an element is inverted.
double min_jacobian(const DisplacementSpace& space, const Points& u);

}  // namespace brainshift::fem
