// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/sampling.hpp"

#include <sstream>
#include <vector>

namespace brainshift::fem {

Result<SamplingMatrix> sampling_matrix(const geometry::TetLocator& locator, int num_nodes,
                                       const Points& points, double tolerance_mm) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(points.cols()) * 4);
  for (int i = 0; i < points.cols(); ++i) {
    const geometry::TetLocation location = locator.locate(points.col(i));
    if (location.distance_mm > tolerance_mm) {
      std::ostringstream text;
      text << "point " << i << " at (" << points.col(i).transpose() << ") mm lies "
           << location.distance_mm << " mm outside the brain (limit " << tolerance_mm << " mm)";
      return invalid(text.str());
    }
    for (int k = 0; k < 4; ++k) {
      if (location.weights[k] != 0.0)
        entries.emplace_back(i, location.nodes[k], location.weights[k]);
    }
  }
  SamplingMatrix matrix(points.cols(), num_nodes);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace brainshift::fem
