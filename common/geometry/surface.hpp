// SPDX-License-Identifier: GPL-3.0-or-later
// Triangle surfaces: boundary of a mesh, normals, offset, volume, sampling, plane sections.
#pragma once

#include <cstdint>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

// Faces that belong to exactly one tetrahedron: 3 x t mesh node indices, oriented outwards, in
// increasing order of their sorted nodes. tet_of_triangle (optional) receives the tetrahedron of
// each face. Precondition: positively oriented tetrahedra.
Eigen::Matrix<int, 3, Eigen::Dynamic> boundary_triangles(
    const TetMesh& mesh, std::vector<int>* tet_of_triangle = nullptr);

// The boundary as a surface of its own: vertices are the boundary nodes in increasing node order;
// node_of_vertex (optional) receives the mesh node of each vertex.
TriangleSurface boundary_surface(const TetMesh& mesh,
                                 std::vector<NodeIndex>* node_of_vertex = nullptr);

// Triangles between nodes of a mesh as a surface of its own, in the same way.
TriangleSurface surface_of(const Points& nodes,
                           const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles,
                           std::vector<NodeIndex>* node_of_vertex = nullptr);

// The triangles between three of these nodes. Vertices are all of the nodes, in increasing order.
// positions: 3 x n, mm; triangles: 3 x t node indices; nodes without repetition.
TriangleSurface surface_between(const Points& positions,
                                const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles,
                                std::vector<NodeIndex> nodes);

// Unit outward normals at the vertices, 3 x v: area-weighted mean of the adjacent triangles'
// normals (the paper's "average nodal normal"). The column of an unused vertex is zero.
Points vertex_normals(const TriangleSurface& surface);

// The surface moved by distance_mm along its vertex normals (paper 2.6: skull = brain + 1 mm).
TriangleSurface offset_surface(const TriangleSurface& surface, double distance_mm);

// Enclosed volume (mm^3) by the divergence theorem, positive for outward orientation. Area
// (mm^2).
double enclosed_volume(const TriangleSurface& surface);
double area(const TriangleSurface& surface);
// By how much a cavity's volume (mm^3) grows when its wall moves. wall: closed, out of the tissue,
// so that the volume it encloses counts negatively. displacement: 3 x v, mm.
double growth_of_cavity(const TriangleSurface& wall, const Points& displacement);
// A third of the area of the triangles at each vertex, mm^2; their sum is area().
VecX vertex_areas(const TriangleSurface& surface);
// Sum over the triangles of their areas times their unit normals, mm^2; zero for a closed surface.
Vec3 vector_area(const TriangleSurface& surface);

// True when every edge is shared by exactly two oppositely oriented triangles.
bool is_closed(const TriangleSurface& surface);

// Edges of exactly two triangles that pass it in the same direction: their normals look to
// opposite sides.
int turned_edges(const TriangleSurface& surface);

// A surface as other programs write it, mended where that loses nothing: vertices within
// tolerance_mm of each other become one (cracks), triangles that collapse thereby go, and so do
// those that are there twice with the same orientation. Vertices without a triangle go too.
struct MendedSurface {
  TriangleSurface surface;
  int merged_vertices = 0;
  int repeated_triangles = 0;
};
MendedSurface mend_surface(const TriangleSurface& surface, double tolerance_mm);

// Closed surface of an ellipsoid with about `edge_mm` between neighbouring vertices: a geodesic
// sphere of frequency n (10 n^2 + 2 vertices, all on the ellipsoid), stretched. Its volume is
// below that of the ellipsoid by a fraction of order (edge / radius)^2. Axes and edge must be >
// 0; n is limited to [1, 512].
TriangleSurface ellipsoid_surface(const Vec3& centre, const Vec3& semi_axes_mm, double edge_mm);

// `count` points drawn uniformly by area (3 x count). The same seed gives the same points on
// every platform. Precondition: at least one triangle, and a positive area.
Points sample_surface(const TriangleSurface& surface, int count, std::uint64_t seed);

// Section of the surface with the plane normal . x == offset: s segments, 3 x 2s. Columns 2i and
// 2i+1 are the ends of segment i; segments are in the order of their triangles. Neighbouring
// segments share their ends bit for bit. A triangle that lies in the plane gives no segment. The
// rim of a flat part that lies in the plane does, where the surface continues below the plane.
Points plane_section(const TriangleSurface& surface, const Vec3& normal, double offset);

}  // namespace brainshift::geometry
