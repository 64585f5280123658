// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedra from a smooth brain mask, by CGAL Mesh_3 (Delaunay refinement, then
// perturbation/exudation).
//
// The domain is {x : mask(x) >= level} with trilinear interpolation. Deterministic: the same
// input gives the same mesh bit for bit on one machine, because seeds are fixed and the
// optimisation stops at a quality bound, never at a time limit. The surface is a closed manifold.
//
// Reference: Jamin, Alliez, Yvinec, Boissonnat, CGALmesh: a generic framework for Delaunay mesh
// generation, ACM Trans. Math. Softw. 41 (2015).
#pragma once

#include <functional>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"

namespace brainshift::geometry {

// Target mean edge length (mm) at a point; finite and > 0 everywhere.
using SizingField = std::function<double(const Vec3&)>;

struct MeshingOptions {
  float level = 0.5f;
  // Optimisation stops when no dihedral angle is smaller. 0: no optimisation, for callers that
  // need only the surface.
  double sliver_bound_deg = 12.0;
  // Points of the surface with which the refinement begins. The default, 12, is too few now and
  // then for a hollow domain: nothing is meshed then (kEmptySet).
  int first_points = 12;
};

// Region of a point of the domain, > 0.
using RegionField = std::function<int(const Vec3&)>;

// Nodes are numbered along a Morton (Z-order) curve and tetrahedra by their lowest node, so that
// neighbours in space are neighbours in memory. Only the largest component (connected by faces) is
// kept, without unused nodes. kEmptySet: the domain is empty, or no tetrahedron came out.
// kDegenerateMesh: the largest component fails check_mesh.
Result<TetMesh> mesh_mask(const VoxelImage& smooth_mask, const SizingField& edge_mm,
                          const MeshingOptions& options = {}, const Progress& progress = {});

// The same domain divided into regions: no tetrahedron has nodes on both sides of an interface, and
// mesh.labels holds the regions. An interface for which `loose` is true is met to two thirds of an
// edge length, the outer surface and the others to 0.15 of it. Where three regions meet, and so
// perhaps at the outer surface, the surfaces need not be manifolds.
Result<TetMesh> mesh_regions(const VoxelImage& smooth_mask, const RegionField& region,
                             const std::function<bool(int, int)>& loose, const SizingField& edge_mm,
                             const MeshingOptions& options = {}, const Progress& progress = {});

}  // namespace brainshift::geometry
