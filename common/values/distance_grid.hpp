// SPDX-License-Identifier: Apache-2.0
// DistanceGrid: signed distance (mm) to a closed surface at the nodes of a regular grid.
// Negative inside the surface.
//
// Node (i, j, k) lies at origin_mm + spacing_mm * (i, j, k), patient RAS; its value is
// values[i + dims[0] * (j + dims[1] * k)]. An empty grid (no values) stands for "not computed".
// Made by geometry::signed_distance_grid, evaluated by geometry::DistanceVolume.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift {

struct DistanceGrid {
  Vec3 origin_mm = Vec3::Zero();
  double spacing_mm = 0.0;
  std::array<int, 3> dims{0, 0, 0};
  std::vector<float> values;

  bool empty() const { return values.empty(); }
  std::size_t num_nodes() const { return grid_size(dims); }
  std::size_t index(int i, int j, int k) const { return grid_index(dims, i, j, k); }
  Vec3 node(int i, int j, int k) const { return origin_mm + spacing_mm * Vec3(i, j, k); }
};

// Ok for an empty grid. kInvalidArgument: fewer than 2 nodes along an axis, a number of values
// that does not match the number of nodes, or a spacing that is not above 0.
// kNotFinite: a value or the origin.
Status validate(const DistanceGrid& grid);

}  // namespace brainshift
