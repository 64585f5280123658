// SPDX-License-Identifier: GPL-3.0-or-later
// Fixed places in a space of linear or quadratic elements, and the displacement there.
#pragma once

#include <vector>

#include "common/fem/displacement_space.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {

class SpacePoints {
 public:
  SpacePoints() = default;
  // points: 3 x m, mm. A point outside the mesh stands for the closest point of the mesh.
  // Precondition: the locator was made of a mesh with a tetrahedron.
  SpacePoints(const geometry::TetLocator& locator, const Points& points);

  // u: 3 x nodes of the space, which is of the locator's mesh. 3 x m.
  Points displacement(const fem::DisplacementSpace& space, const Points& u) const;
  // Of a point outside the mesh; 0: all lie inside.
  double farthest_outside_mm() const { return farthest_mm_; }

 private:
  struct Place {
    int element;
    Eigen::Vector4d l;
  };
  std::vector<Place> places_;
  double farthest_mm_ = 0.0;
};

}  // namespace brainshift::client
