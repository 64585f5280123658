// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of meshes: boundary extraction, normals, offset, sampling.
#pragma once

#include <cstdint>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

// Faces that belong to exactly one tetrahedron, 3 x t mesh node indices, oriented outwards; in increasing
// order of their sorted nodes. tet_of_triangle (optional) receives the tetrahedron of each.
// Precondition: positively oriented tetrahedra.
Eigen::Matrix<int, 3, Eigen::Dynamic> boundary_triangles(
    const TetMesh& mesh, std::vector<int>* tet_of_triangle = nullptr);

// The boundary as a surface of its own: vertices are the boundary nodes in increasing node order;
// node_of_vertex (optional) receives the mesh node of each vertex.
TriangleSurface boundary_surface(const TetMesh& mesh,
                                 std::vector<NodeIndex>* node_of_vertex = nullptr);

// Unit outward normals at vertices, 3 x v: area-weighted mean of the adjacent triangles' normals (the
// paper's "average nodal normal"); zero column for an unused vertex.
Points vertex_normals(const TriangleSurface& surface);

// The surface moved by distance_mm along its vertex normals (paper 2.6: skull = brain + 1 mm).
TriangleSurface offset_surface(const TriangleSurface& surface, double distance_mm);

// Enclosed volume (mm^3) by the divergence theorem, positive for outward orientation; and area (mm^2).
double enclosed_volume(const TriangleSurface& surface);
double area(const TriangleSurface& surface);

// True when every edge is shared by exactly two oppositely oriented triangles.
bool is_closed(const TriangleSurface& surface);

// A closed surface of an ellipsoid, about `edge_mm` between neighbouring vertices: a geodesic sphere of
// frequency n (10 n^2 + 2 vertices, all on the ellipsoid), stretched. Its volume is below the ellipsoid's
// by a fraction of order (edge / radius)^2. Axes and edge must be > 0; n is limited to [1, 512].
TriangleSurface ellipsoid_surface(const Vec3& centre, const Vec3& semi_axes_mm, double edge_mm);

// `count` points drawn uniformly by area (3 x count); the same seed gives the same points on every platform.
// Precondition: at least one triangle, of positive area.
Points sample_surface(const TriangleSurface& surface, int count, std::uint64_t seed);

// Where a plane (point x with normal . x == offset) cuts the surface: segments, 3 x 2s, columns 2i and 2i+1
// are the ends of segment i, in the order of their triangles. Neighbouring segments share their ends bit for
// bit. A triangle in the plane gives no segment of its own; the rim of a flat part lying in the plane does
// where the surface goes on below the plane.
Points plane_section(const TriangleSurface& surface, const Vec3& normal, double offset);

}  // namespace brainshift::geometry
