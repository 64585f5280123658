// SPDX-License-Identifier: GPL-3.0-or-later
// Which tetrahedron holds a point, and its barycentric weights: the rows of the sampling matrix A.
//
//   x = sum_k weights[k] nodes.col(nodes[k])
//
// Inside: a uniform grid of tetrahedra. Outside: the closest point of the boundary triangles; weights then
// describe that point, of the tetrahedron behind it (the fourth weight is 0).
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
  double distance_mm =
      0.0;  // 0 inside; else distance from the query to the point the weights describe
};

class TetLocator {
 public:
  // Copies what it needs. Precondition: check_mesh(mesh), or no tetrahedron at all.
  explicit TetLocator(const TetMesh& mesh);
  TetLocator(TetLocator&&) noexcept;
  TetLocator& operator=(TetLocator&&) noexcept;
  ~TetLocator();

  // The tetrahedron holding the query; outside the mesh, the closest point of the mesh. Thread-safe.
  // A query that is not finite, or a mesh without tetrahedra: tet -1, infinite distance.
  TetLocation locate(const Vec3& query) const;

  // Its copy of the mesh.
  const Points& nodes() const;
  const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::geometry
