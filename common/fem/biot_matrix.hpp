// SPDX-License-Identifier: GPL-3.0-or-later
// The matrix of one backward-Euler step of Biot consolidation on P1-P1 tetrahedra (paper eq.
// 1-2). It is symmetric quasi-definite:
//
//   [ K    -G          ] [ u ]     K  drained stiffness        G_ij = int alpha N_j div v_i
//   [ -G^T -(dt H+M+P) ] [ p ]     H  = k grad N . grad N      M = S N N,  P stabilisation
//
// Order of unknowns: displacements as in DofMap, then the pressure of every node that is not
// drained, by node index.
// Units: mm, N, s; pressure N/mm^2.
//
// Stabilisation. Equal-order pressure oscillates when the step is below the bound of Vermeer and
// Verruijt (1981, Int. J. Numer. Anal. Methods Geomech. 5:1), h^2 / (6 c_v). Below the bound the
// element gets the polynomial pressure projection of Bochev, Dohrmann and Gunzburger (2006), in
// the form of White and Borja (2008, CMAME 197:4353), on the increment of p:
//
//   P_ij = theta alpha^2 / (2 G) integral (N_i - mean N_i)(N_j - mean N_j)
//   theta = max(0, 1 - dt / bound)
//
// theta fades the term in, so that the solution is continuous in dt. h is the edge of the regular
// tetrahedron with the element's volume; c_v = k / (S + alpha^2 / (lambda + 2 G)).
#pragma once

#include <vector>

#include "common/core/mesh.hpp"
#include "common/fem/dof_map.hpp"
#include "common/fem/elasticity.hpp"

namespace brainshift::fem {

// Pressure unknowns of a mesh: -1 where the pressure is prescribed.
struct PressureMap {
  std::vector<int> unknown;
  int num_unknowns = 0;
  PressureMap() = default;
  PressureMap(int num_nodes, const std::vector<NodeIndex>& drained);
};

// c_v, mm^2/s. 0 without permeability; infinite for an element that neither stores nor couples
// (S = alpha = 0).
double consolidation_coefficient(const PoroMaterial& material);
// h^2 / (6 c_v) of one element, seconds; infinite without permeability.
double vermeer_verruijt_step_s(const PoroMaterial& material, double volume_mm3);

// Element matrices for the four local nodes. `coupling` is 3 x 4: G_(i a)j, for node i, axis a
// and pressure node j, is the same for every j, so column i holds alpha V / 4 grad N_i.
struct BiotElement {
  Eigen::Matrix4d diffusion;      // H
  Eigen::Matrix4d storage;        // M
  Eigen::Matrix4d stabilisation;  // P
  Eigen::Matrix<double, 3, 4> coupling;
};
BiotElement biot_element(const TetGeometry& geometry, const PoroMaterial& material, double dt_s,
                         bool stabilise);

struct BiotMatrix {
  linalg::SymmetricMatrix lower;
  int displacement_unknowns = 0, pressure_unknowns = 0;
  int stabilised_tets = 0;  // elements with theta > 0
};
// Precondition: valid materials, dt_s > 0 and finite (BiotStepper checks them).
BiotMatrix assemble_biot(const TetMesh& mesh, const MaterialMap& materials, const DofMap& dofs,
                         const PressureMap& pressure, double dt_s, bool stabilise = true);
// Puts another stiffness of the same pattern (K_p, for example) in the place of K.
void replace_stiffness(BiotMatrix& matrix, const linalg::SymmetricMatrix& stiffness);

}  // namespace brainshift::fem
