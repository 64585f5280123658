// SPDX-License-Identifier: GPL-3.0-or-later
// The ventricles of a head whose mesh has them as cavities: suction on their wall, and what volume
// they lose.
#pragma once

#include "common/fem/displacement_space.hpp"
#include "common/fem/space_elasticity.hpp"

namespace brainshift::outside {

using Wall = Eigen::Matrix<int, 3, Eigen::Dynamic>;  // faces of a space, out of its tissue

// Beyond the sagittal plane x = middle_x, towards sign (-1 or +1); sign 0: all of the cavity.
struct CavityPart {
  double middle_x = 0.0;
  double sign = 0.0;
};

// Volume of the part, mm^3, with the wall moved by u (3 x nodes of the space, mm). A quadratic face
// is four flat triangles between its nodes. By the divergence theorem with F = (f, 0, 0), f = x or
// f = sign max(sign (x - middle_x), 0); exact on triangles that the plane does not cross.
double cavity_volume(const fem::DisplacementSpace& space, const Points& u, const Wall& wall,
                     const CavityPart& part = {});

// The part of that volume that is lost, 0 to 1; below 0: it has grown. 0 where there is none.
double cavity_loss(const fem::DisplacementSpace& space, const Points& u, const Wall& wall,
                   const CavityPart& part = {});

// Nodal forces of a suction, N/mm^2, on the part's wall: 3 x nodes of the space, N.
Points suction_load(const fem::DisplacementSpace& space, const Wall& wall, const CavityPart& part,
                    double suction);

}  // namespace brainshift::outside
