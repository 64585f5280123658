// SPDX-License-Identifier: GPL-3.0-or-later
// Sampling matrix A (paper eq. 4): displacement at points inside the mesh, by linear
// interpolation.
#pragma once

#include <Eigen/SparseCore>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::fem {

// Scalar weights, m x n: row i holds the (up to four) barycentric weights of point i. The paper's
// A applies this matrix to each component: A u = u * weights^T with u 3 x n.
using SamplingMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// kInvalidArgument names the first point that lies farther than tolerance_mm outside the mesh,
// with its distance.
Result<SamplingMatrix> sampling_matrix(const geometry::TetLocator& locator, int num_nodes,
                                       const Points& points, double tolerance_mm);

}  // namespace brainshift::fem
