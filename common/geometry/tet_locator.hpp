// SPDX-License-Identifier: GPL-3.0-or-later
// TetLocator: the tetrahedron that holds a point, and the point's barycentric weights. They are
// the rows of the sampling matrix A.
//
//   x = sum_k weights[k] nodes.col(nodes[k])
//
// Inside the mesh the search uses a uniform grid of tetrahedra. Outside, it takes the closest
// point of the boundary triangles: the weights describe that point in the tetrahedron behind it,
// and the fourth weight is 0.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

struct TetLocation {
  int tet = -1;
  Eigen::Vector4i nodes = Eigen::Vector4i::Zero();
  Eigen::Vector4d weights = Eigen::Vector4d::Zero();  // sum 1; all >= 0 when inside
  // 0 inside; outside, the distance from the query to the point that the weights describe.
  double distance_mm = 0.0;
};

// What the mesh interpolates at a location from the values of its nodes: 3 x nodes, or one each.
inline Vec3 value_at(const TetLocation& at, const Points& nodal) {
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < 4; ++k) value += at.weights[k] * nodal.col(at.nodes[k]);
  return value;
}
inline double value_at(const TetLocation& at, const VecX& nodal) {
  double value = 0.0;
  for (int k = 0; k < 4; ++k) value += at.weights[k] * nodal[at.nodes[k]];
  return value;
}

class TetLocator {
 public:
  // Copies the mesh. Precondition: check_mesh(mesh), or no tetrahedron at all.
  explicit TetLocator(const TetMesh& mesh);
  TetLocator(TetLocator&&) noexcept;
  TetLocator& operator=(TetLocator&&) noexcept;
  ~TetLocator();

  // The tetrahedron that holds the query; for a query outside, the closest point of the mesh.
  // Thread-safe. A query that is not finite, or a mesh without tetrahedra: tet -1, infinite
  // distance.
  TetLocation locate(const Vec3& query) const;

  // Its copy of the mesh.
  const Points& nodes() const;
  const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::geometry
