// SPDX-License-Identifier: GPL-3.0-or-later
// Distances from a surface of the model to measured points of it. As sparse data they let the
// surface slide along itself.
//
// For a measured point p and a displacement u of the surface:
//   q  the closest point of the deformed surface
//   x  the place of q before deformation
//   n  the deformed surface's unit normal at q
//   n . u(x) = n . (p - x)       is what the point measures, mm
// That is the part of the displacement along n. A point says nothing about how the surface slides
// along itself: a ball shows no rotation. x and n depend on u, so the data are made anew as the
// estimate moves. This is the data side of non-rigid ICP (Chui & Rangarajan 2003; paper 2.7 for
// the rigid kind).
//
// Many more points are measured than guide the model. With options.average_mm a guiding point
// stands for its neighbours (a superobservation, Lorenc 1981, Mon Weather Rev 109:701): its
// distance is the median of theirs, whose errors of their own mostly cancel. A gross error among
// them does not matter. Distances also differ because the surface has moved otherwise than
// rigidly; the median is therefore that of what an affine displacement of the whole surface leaves.
//
// The first data are those of a rigid motion of the surface, such as a rigid ICP's: far from the
// surface, closest points would lie on its wrong side. Of that motion nothing else enters the data.
#pragma once

#include <Eigen/SparseCore>

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/statistics.hpp"
#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/moving_surface.hpp"
#include "common/registration/outline_errors.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::registration {

// SurfacePatch: a surface that moves with the mesh, as an instrument sees it: the cortex under the
// craniotomy, or the boundary of the tumour.
//
//   vertex v moves by  sum_i weights(i, v) u(nodes[i])
struct SurfacePatch {
  std::vector<NodeIndex> nodes;  // of the mesh that move the surface, ascending
  TriangleSurface surface;       // undeformed, outward
  // nodes x vertices, columns of sum 1: 3 x nodes displacements times it are those of the vertices.
  Eigen::SparseMatrix<double> weights;
};

// Boundary triangles between three craniotomy nodes; no triangle when there are none. Vertex i is
// nodes[i].
SurfacePatch craniotomy_patch(const BrainModel& model);

// The tumour's surface, whose vertices are points inside tetrahedra. A vertex outside the mesh
// moves as the closest point of the mesh does. Precondition: the mesh has a tetrahedron.
SurfacePatch tumour_patch(const BrainModel& model);

// A patch with its index: what observations of one surgery share.
class IndexedPatch {
 public:
  // Errors as ClosestPointIndex::build.
  static Result<std::shared_ptr<const IndexedPatch>> build(SurfacePatch patch);

  const SurfacePatch& patch() const { return patch_; }
  const geometry::MovingSurface& surface() const { return surface_; }

 private:
  IndexedPatch(SurfacePatch patch, geometry::MovingSurface surface)
      : patch_(std::move(patch)), surface_(std::move(surface)) {}
  SurfacePatch patch_;
  geometry::MovingSurface surface_;
};

struct SurfaceDistanceOptions {
  int points = 300;           // at most; chosen of those over the surface, always the same ones
  double sd_mm = 0.5;         // of a point along the normal, apart from its neighbours
  double shared_sd_mm = 0.0;  // of what it and its neighbours are off by alike, besides
  // How far on the undeformed surface a point may lie from the guiding point nearest to it and
  // still count to its neighbours. With k of them, itself among them, the variance of a datum is
  // pi sd^2 / (2 k) + shared_sd^2 (that of a median of many normal errors). 0, or k below
  // kFewestAveraged: the point is as it was measured.
  double average_mm = 0.0;
  double pose_sd_mm = 0.0;   // of the instrument's place: three common errors (none if 0)
  double pose_sd_deg = 0.0;  // of its direction, about the points' centroid: three more
  // What neighbours on the surface as it was outlined are off by alike, of unknown size
  // (outline_errors.hpp): common errors of the data.
  bool outline_errors = false;
  // Fewer points over the surface are an error, in these words.
  int fewest = 10;
  std::stop_token stop = {};  // looked at by build() among the points
  std::string measured = "cortical surface", surface = "craniotomy";
};

inline constexpr int kFewestAveraged = 3;
// From the surface; a point farther away is not of it.
inline constexpr double kFarthestPoint_mm = 30.0;
// The data are settled when no x has moved by more: across the surface, and along it, where a
// distance hardly notices.
inline constexpr double kSettled_mm = 0.02, kSettledAlong_mm = 0.3;

class SurfaceDistances {
 public:
  // measured: 3 x m, mm RAS. T_undeformed_measured: the rigid motion from the measured points to
  // the undeformed surface. kInvalidArgument: fewer than options.fewest points lie over the
  // surface, so moved (the sentence says how many, and how far away their mean is). kNotFinite:
  // names the point. kNotConverged: options.stop was requested.
  static Result<SurfaceDistances> build(
      std::shared_ptr<const IndexedPatch> patch, const Points& measured,
      const SurfaceDistanceOptions& options = {},
      const RigidTransform& T_undeformed_measured = RigidTransform::Identity());

  const std::vector<NodeIndex>& nodes() const { return patch_->patch().nodes; }
  // The data before any estimate: for the rigid motion given to build().
  SparseData first() const;
  // u: 3 x nodes(), mm. A point whose closest point lies on the rim of the surface gives no datum,
  // so the count may differ from call to call.
  SparseData at(const Points& u) const;
  // True when some x of `now` lies farther from that of `before` than the options call settled, or
  // the counts differ.
  bool moved(const SparseData& before, const SparseData& now) const;

 private:
  SurfaceDistances(std::shared_ptr<const IndexedPatch> patch, const SurfaceDistanceOptions& options,
                   const RigidTransform& T_undeformed_measured);
  // Data of the columns of `measured`, with these standard deviations, that lie over the interior
  // of the surface with these vertices. `kept`, if not null, receives their indices.
  SparseData measure(Points vertices, const Points& measured, const VecX& sd_mm,
                     std::vector<int>* kept) const;
  // measure() of the guiding points, with what they are off by alike.
  SparseData measure_guiding(Points vertices) const;
  // Moves the guiding points along their normals to the medians, and sets their standard
  // deviations. data: of all points that were measured; guiding: which of them guide.
  void average(const SparseData& data, const std::vector<int>& guiding);
  Points first_vertices() const;

  std::shared_ptr<const IndexedPatch> patch_;
  SurfaceDistanceOptions options_;
  RigidTransform T_undeformed_measured_;
  Points guiding_;         // the measured points in use
  VecX sd_mm_;             // of their distances
  OutlineErrors outline_;  // of the guiding points; none: no columns
};

// Closest point projection distance (paper 2.7) from nodes to a measured surface of the brain.
//
//   |d_i| = |q_i - x_i|,   d_i > 0 when (q_i - x_i) . n(q_i) > 0
//   q_i: closest surface point to node x_i;  n: outward pseudo-normal
//
// The sign is negative when node x_i lies on the outward side of the surface, positive on the
// inner side, as in the paper. The pseudo-normal gives the right sign at edges and vertices too.
// A node beside an open surface is measured to the surface's rim, so pass only nodes that face the
// surface.

// nodes: 3 x n, finite, mm, in the surface's frame. Returns n signed distances, mm.
VecX signed_projection_distance(const Points& nodes, const geometry::ClosestPointIndex& surface);

// Mean and standard deviation of |d_i|, mm.
MeanStd mismatch(const VecX& signed_distances);

}  // namespace brainshift::registration
