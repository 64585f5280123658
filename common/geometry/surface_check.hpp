// SPDX-License-Identifier: GPL-3.0-or-later
// Is this surface fit to be the exposed cortex of a case? Asked before a surface from any source (stereopsis, laser
// scanner, a file) may enter the inversion.
//
// Refused, with one sentence that names the figure:
//   kNotFinite         a coordinate that is not finite
//   kEmptySet          fewer than min_points points
//   kInvalidArgument   extent (diagonal of the bounding box) outside the bounds that the craniotomy's size sets; the
//                      sentence names metres, centimetres or micrometres where those would fit
//                      closest point farther than max_distance_mm from the craniotomy's centre
//                      normals that look neither outwards nor inwards (mean |cosine| below min_cosine)
//   kDegenerateMesh    an edge of more than two triangles; two neighbours turned against each other; a triangle that
//                      names a vertex twice or one that does not exist
// Mended: a surface whose normals look inwards as a whole is turned round, all triangles alike, and says so. Whoever
// numbered the corners the other way has measured the same points; a part turned against the rest is another matter.
// Reported: holes and separate parts. A surface without triangles (points only) has no normals and no holes.
#pragma once

#include <string>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

// Where the cortex of a case lies open.
struct CorticalSite {
  Vec3 centre = Vec3::Zero();    // mm RAS
  Vec3 outward = Vec3(0, 0, 1);  // unit, out of the head
  double size_mm = 45.0;         // long axis of the craniotomy
};

// Of a model's craniotomy: mean of its nodes, area-weighted mean of the boundary's normals between them, and the
// largest distance of two of its nodes. kEmptySet when the model has no craniotomy with a boundary triangle.
Result<CorticalSite> craniotomy_site(const BrainModel& model);

struct SurfaceCheckOptions {
  int min_points = 50;
  // Extent over the craniotomy's size: a camera may see a part of it only, or drapes and skin around it.
  double min_extent = 0.2, max_extent = 6.0;
  double max_distance_mm =
      25.0;  // brain sinks by up to 20 mm (Roberts et al. 1998); farther, the pose is wrong
  double min_cosine = 0.3;
};

struct CheckedSurface {
  TriangleSurface surface;
  bool turned = false;  // its triangles looked inwards
  double extent_mm = 0.0;
  double distance_mm = 0.0;  // of the closest point from the craniotomy's centre
  int parts = 0;             // that hang together by edges
  int holes = 0;             // rims beyond the longest one of each part
  double longest_hole_rim_mm = 0.0;
  std::vector<std::string> notes;  // sentences on what was mended or is worth knowing
};

Result<CheckedSurface> check_cortical_surface(TriangleSurface surface, const CorticalSite& site,
                                              const SurfaceCheckOptions& options = {});

}  // namespace brainshift::geometry
