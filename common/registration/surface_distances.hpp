// SPDX-License-Identifier: GPL-3.0-or-later
// Distances from the model's cortex to a measured surface, as sparse data that let the cortex slide.
//
// For a measured point p and a deformation u of the patch: q is the closest point of the deformed patch, x the place of
// q before deformation and n the patch's unit normal at q. The point measures
//   n . u(x) = n . (p - x)
// the part of the displacement along n; where the surface slides along itself, it says nothing. x and n depend on u: the
// data are made anew as the estimate moves (the data side of non-rigid ICP; Chui & Rangarajan 2003, and paper 2.7 for
// the rigid kind).
#pragma once

#include <vector>

#include "common/values/brain_model.hpp"
#include "common/core/error.hpp"
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
  int points = 300;           // chosen of those over the patch, always the same ones
  double sd_mm = 0.5;         // of a point along the normal
  double pose_sd_mm = 0.0;    // of the camera's place: three common errors (none if 0)
  double pose_sd_deg = 0.0;   // of its direction, about the points' centroid: three more
  double farthest_mm = 30.0;  // from the undeformed patch; what lies farther is not the cortex
  double settled_mm = 0.5;    // the data are settled when no x has moved by more
};

class SurfaceDistances {
 public:
  // measured: 3 x m, patient RAS. kEmptySet when the patch has no triangle; kInvalidArgument when fewer than
  // kFewestPoints lie over the patch (the sentence says how many and where the rest lies); kNotFinite names the point.
  static Result<SurfaceDistances> build(SurfacePatch patch, const Points& measured,
                                        const SurfaceDistanceOptions& options = {});

  const std::vector<NodeIndex>& nodes() const { return patch_.nodes; }
  // u: 3 x nodes(), mm. Points whose closest point lies on the rim of the patch give no datum, so the count may differ
  // from call to call.
  SparseData at(const Points& u) const;
  // True when some x of `now` lies more than settled_mm from that of `before`, or their counts differ.
  bool moved(const SparseData& before, const SparseData& now) const;

  static constexpr int kFewestPoints = 10;

 private:
  SurfaceDistances(SurfacePatch patch, const SurfaceDistanceOptions& options);
  // Measured points (columns of `measured`) over the interior of the patch moved by u, with their data.
  SparseData measure(const Points& u, const Points& measured, std::vector<int>* kept) const;

  SurfacePatch patch_;
  SurfaceDistanceOptions options_;
  std::vector<char>
      rim_edge_;    // 3 per triangle: edge k from corner k to k + 1 belongs to one triangle only
  Points guiding_;  // measured points that are used
};

}  // namespace brainshift::registration
