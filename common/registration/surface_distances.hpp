// SPDX-License-Identifier: GPL-3.0-or-later
// Distances from the model's cortex to a measured surface. As sparse data they let the cortex
// slide.
//
// For a measured point p and a deformation u of the patch:
//   q  the closest point of the deformed patch
//   x  the place of q before deformation
//   n  the patch's unit normal at q
//   n . u(x) = n . (p - x)       is what the point measures, mm
// That is the part of the displacement along n. A point says nothing about how the surface slides
// along itself. x and n depend on u, so the data are made anew as the estimate moves. This is the
// data side of non-rigid ICP (Chui & Rangarajan 2003; paper 2.7 for the rigid kind).
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::registration {

// A part of the mesh's boundary that a camera sees.
struct SurfacePatch {
  std::vector<NodeIndex> nodes;  // of the mesh, ascending; vertex i of the surface is nodes[i]
  TriangleSurface surface;       // undeformed, outward
};

// Boundary triangles between three craniotomy nodes; no triangle when there are none.
SurfacePatch craniotomy_patch(const BrainModel& model);

struct SurfaceDistanceOptions {
  int points = 300;           // at most; chosen of those over the patch, always the same ones
  double sd_mm = 0.5;         // of a point along the normal
  double pose_sd_mm = 0.0;    // of the camera's place: three common errors (none if 0)
  double pose_sd_deg = 0.0;   // of its direction, about the points' centroid: three more
  double farthest_mm = 30.0;  // from the patch; a point farther away is not on the cortex
  double settled_mm = 0.5;    // the data are settled when no x has moved by more
};

class SurfaceDistances {
 public:
  // measured: 3 x m, mm RAS. kEmptySet: the patch has no triangle. kInvalidArgument: fewer than
  // kFewestPoints lie over the patch (the sentence says how many, and how far away their mean is).
  // kNotFinite: names the point.
  static Result<SurfaceDistances> build(SurfacePatch patch, const Points& measured,
                                        const SurfaceDistanceOptions& options = {});

  const std::vector<NodeIndex>& nodes() const { return patch_.nodes; }
  // u: 3 x nodes(), mm. A point whose closest point lies on the rim of the patch gives no datum,
  // so the count may differ from call to call.
  SparseData at(const Points& u) const;
  // True when some x of `now` lies over settled_mm from that of `before`, or the counts differ.
  bool moved(const SparseData& before, const SparseData& now) const;

  static constexpr int kFewestPoints = 10;

 private:
  SurfaceDistances(SurfacePatch patch, const SurfaceDistanceOptions& options);
  // Data of the columns of `measured` that lie over the interior of the patch moved by u. `kept`,
  // if not null, receives their indices.
  SparseData measure(const Points& u, const Points& measured, std::vector<int>* kept) const;

  SurfacePatch patch_;
  SurfaceDistanceOptions options_;
  // 3 per triangle: 1 where edge k, from corner k to k + 1, belongs to one triangle only.
  std::vector<char> rim_edge_;
  Points guiding_;  // the measured points in use
};

}  // namespace brainshift::registration
