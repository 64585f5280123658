// SPDX-License-Identifier: GPL-3.0-or-later
// Check that a surface from any source (stereopsis, laser scanner, a file) can be the exposed
// cortex of a case. It runs before the surface may enter the inversion.
//
// Rejected, with one sentence that names the figure:
//   kNotFinite         a coordinate that is not finite
//   kEmptySet          fewer than 50 points
//   kInvalidArgument   extent (diagonal of the bounding box) outside the bounds that the
//                      craniotomy's size sets; the sentence names metres, centimetres or
//                      micrometres where those would fit
//                      closest point farther than 25 mm from the craniotomy's centre
//                      normals that look neither outwards nor inwards (mean |cosine| below
//                      0.3)
//   kDegenerateMesh    an edge of more than two triangles; two neighbours with opposite
//                      orientation; a triangle that names a vertex twice, or one that does not
//                      exist
//
// Mended: when the normals as a whole look inwards, all triangles are turned round, and a note
// reports it. The measured points are the same; only the corners were numbered the other way. A
// part with another orientation than the rest is rejected instead.
//
// Reported: holes and separate parts. A surface without triangles (points only) has no normals
// and no holes.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::geometry {

// Edges of a triangle surface: shared edges, the rims of holes, the parts connected by edges.
struct SurfaceRims {
  int parts = 0;                 // components of triangles connected by edges
  std::vector<int> part_of_rim;  // per closed rim
  std::vector<double> rim_mm;    // its length
  int open_edges = 0;            // of all rims
};

// kDegenerateMesh: a triangle with a repeated or unknown vertex, an edge of more than two
// triangles, or an edge that two triangles pass in the same direction. The sentence names the
// triangles or the vertices.
Result<SurfaceRims> surface_rims(const TriangleSurface& surface);

// Place where the cortex of a case is exposed.
struct CorticalSite {
  Vec3 centre = Vec3::Zero();    // mm RAS
  Vec3 outward = Vec3(0, 0, 1);  // unit, out of the head
  double size_mm = 45.0;         // long axis of the craniotomy
};

// Site of a model's craniotomy: centre, mean of its nodes; outward, area-weighted mean of the
// boundary normals between them; size, the largest distance between two of its nodes.
// kEmptySet: the model has no craniotomy, or its nodes span no boundary triangle.
Result<CorticalSite> craniotomy_site(const BrainModel& model);

struct CheckedSurface {
  TriangleSurface surface;
  bool turned = false;  // its triangles looked inwards
  double extent_mm = 0.0;
  double distance_mm = 0.0;  // of the closest point from the craniotomy's centre
  int parts = 0;             // components of triangles connected by edges
  int holes = 0;             // rims beyond the longest one of each part
  double longest_hole_rim_mm = 0.0;
  std::vector<std::string> notes;  // sentences on what was mended or is worth knowing
};

Result<CheckedSurface> check_cortical_surface(TriangleSurface surface, const CorticalSite& site);

}  // namespace brainshift::geometry
