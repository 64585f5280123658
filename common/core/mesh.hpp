// SPDX-License-Identifier: Apache-2.0
// Plain geometry values: tetrahedral mesh, triangle surface, voxel image. The algorithms on them
// are in common/geometry.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift {

// Points one after the other as columns, 3 x n.
inline Points columns_of(const std::vector<Vec3>& points) {
  const double* const first = points.empty() ? nullptr : points.front().data();
  return Eigen::Map<const Points>(first, 3, static_cast<Eigen::Index>(points.size()));
}

// Linear tetrahedra. nodes: 3 x n, mm RAS. tets: 4 x m node indices; positively oriented, i.e.
// det[x1-x0, x2-x0, x3-x0] > 0. labels: m region labels (0 = brain) or empty.
struct TetMesh {
  Points nodes;
  Eigen::Matrix<int, 4, Eigen::Dynamic> tets;
  std::vector<int> labels;

  int num_nodes() const { return static_cast<int>(nodes.cols()); }
  int num_tets() const { return static_cast<int>(tets.cols()); }
};

// Triangles: 3 x t vertex indices, counter-clockwise seen from outside (outward normals).
struct TriangleSurface {
  Points vertices;  // 3 x v, mm RAS
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles;

  int num_vertices() const { return static_cast<int>(vertices.cols()); }
  int num_triangles() const { return static_cast<int>(triangles.cols()); }
};

// A tetrahedral mesh with the names that its file gives to regions and surfaces.
// The volume labels are mesh.labels. Triangles have labels of their own (0: none); a triangle
// that belongs to several groups is listed once per group. Names map to labels. A label without a
// name is called by its number.
struct GroupedMesh {
  TetMesh mesh;
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles;  // mesh nodes, in either orientation
  std::vector<int> triangle_labels;
  std::map<std::string, int> volume_names;
  std::map<std::string, int> surface_names;
};

// Of a regular grid: how many nodes or voxels it has, and the place of (i, j, k) among its values,
// i + dims[0] * (j + dims[1] * k): x fastest. The indices lie within dims.
inline std::size_t grid_size(const std::array<int, 3>& dims) {
  return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
         static_cast<std::size_t>(dims[2]);
}
inline std::size_t grid_index(const std::array<int, 3>& dims, int i, int j, int k) {
  const auto at = [](int n) { return static_cast<std::size_t>(n); };
  return at(i) + at(dims[0]) * (at(j) + at(dims[1]) * at(k));
}

// Scalar voxel image; the centre of voxel (i, j, k) lies at T_ras_voxel * (i, j, k), mm RAS, its
// value is values[grid_index(dims, i, j, k)]. The affine may be oblique or left-handed.
struct VoxelImage {
  std::array<int, 3> dims{0, 0, 0};
  AffineTransform T_ras_voxel = AffineTransform::Identity();
  std::vector<float> values;

  float at(int i, int j, int k) const { return values[grid_index(dims, i, j, k)]; }
  std::size_t num_voxels() const { return grid_size(dims); }
};

}  // namespace brainshift
