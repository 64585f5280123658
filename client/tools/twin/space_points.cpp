// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/space_points.hpp"

#include <algorithm>

#include "common/fem/space_elasticity.hpp"

namespace brainshift::client {

SpacePoints::SpacePoints(const geometry::TetLocator& locator, const Points& points) {
  places_.reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const geometry::TetLocation found = locator.locate(points.col(i));
    farthest_mm_ = std::max(farthest_mm_, found.distance_mm);
    Place place{found.tet, Eigen::Vector4d::Zero()};
    for (int k = 0; k < 4; ++k) {  // a location outside lists the vertices in another order
      for (int j = 0; j < 4; ++j) {
        if (found.nodes[j] == locator.tets()(k, found.tet)) place.l[k] = found.weights[j];
      }
    }
    places_.push_back(place);
  }
}

Points SpacePoints::displacement(const fem::DisplacementSpace& space, const Points& u) const {
  Points values(3, static_cast<Eigen::Index>(places_.size()));
  for (std::size_t i = 0; i < places_.size(); ++i) {
    values.col(static_cast<Eigen::Index>(i)) =
        fem::displacement_at(space, u, places_[i].element, places_[i].l);
  }
  return values;
}

}  // namespace brainshift::client
