// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid iterative closest point from boundary points to a surface (paper 2.7; Besl & McKay 1992).
// It has the point-to-plane error of Chen & Medioni 1992, Welsch weights and a Gaussian prior on
// the rotation.
//
//   min over T   sum_i rho(r_i) / sd^2  +  |rotation angle(T T_initial^-1)|^2 / rotation_sd^2
//   rho(r) = 2 s^2 (1 - exp(-r^2 / 2 s^2)),  weight w(r) = rho'(r) / 2r = exp(-r^2 / 2 s^2)
//   r_i = distance of T p_i from the surface, n_i its gradient (TargetSurface)
//
// Its parts: distances from the surface (TargetSurface); the normal equations of a pose, which axes
// they show and small motions (pose_information.hpp).
//
// As n_i is the gradient of r_i, the objective itself checks each Gauss-Newton step: the step is
// halved until the objective goes down. The scale s starts at twice the median distance and
// shrinks to welsch_scale_mm, which widens the basin of convergence.
// Rotation is about the centroid of the points, so that rotation and translation decouple.
//
// Axes that the data do not show (a sphere shows no rotation) take no step from the data. There
// the pose stays at the initial one, or goes where the prior draws it.
// The prior's standard deviation is weighed against *independent* points. Where few points guide
// the rotation, it draws towards the initial pose, by design.
//
// Assumption: point errors are independent with standard deviation sd_mm along the surface normal.
#pragma once

#include <functional>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/registration/pose_information.hpp"

namespace brainshift::registration {

// The surface that points are aligned to, as ICP sees it: distances of many points at once, and
// their gradients.
//
//   r_i = distance of x_i from the surface, mm;   g_i = grad r_i at x_i, no unit
//   triangles  q_i the closest surface point, g_i the direction from q_i to x_i: the triangle's
//              normal (up to sign), at an edge or vertex the one of its normals that points there;
//              exact, about 1 us a point
//   volume     interpolated (geometry/distance_volume.hpp): wrong by hundredths of a millimetre,
//              some 10 ns a point
//
// A view: it refers to the surface, which must outlive it. Calls from several threads are safe.
class TargetSurface {
 public:
  // Implicit: align(points, surface, ...) takes either.
  TargetSurface(const geometry::ClosestPointIndex& triangles);
  TargetSurface(const geometry::DistanceVolume& volume);

  // points: m x 3, finite, mm. distances_mm and gradients must have m rows.
  void measure(const geometry::PointRows& points, VecX& distances_mm,
               geometry::PointRows& gradients) const {
    measure_(points, distances_mm, gradients);
  }

 private:
  std::function<void(const geometry::PointRows&, VecX&, geometry::PointRows&)> measure_;
};

// The options of align(), and the checks of its input.
struct IcpOptions {
  int max_iterations = 50;
  double sd_mm = 0.5;            // of a boundary point along the normal
  double welsch_scale_mm = 3.0;  // s: residual at which a point's weight falls to exp(-1/2)
  double rotation_sd_deg = 3.0;  // of the prior; <= 0 switches it off
  bool rotation = true;          // false: translation only
  double translation_tolerance_mm = 1e-4, rotation_tolerance_deg = 1e-4;
  // An axis is reported unobservable when its Hessian eigenvalue (data only, rotation scaled by
  // the point cloud's rms radius) is below this fraction of the largest. At 1e-2 the axis is known
  // ten times worse than the best one. Measured for the least visible rotation: 4.6e-4 for the
  // facets of a sphere of 2,562 vertices, 3e-3 for semi-axes of 14, 13 and 20 mm, 2.6e-2 for 14,
  // 11 and 20 mm.
  double observability_ratio = 1e-2;
  std::stop_token stop = {};  // looked at once per iteration
};

struct IcpResult {
  RigidTransform T_surface_points = RigidTransform::Identity();  // x_surface = T x_points
  bool converged = false;
  int iterations = 0;
  double rms_mm = 0.0;      // of the residuals at the end, weighted by w
  int observable_axes = 0;  // of 6
  // All three rotation axes are observable, the translation being unknown too.
  bool rotation_observable = false;
  // What rotation axes that took no step from the data (switched off, or not observable) may move
  // a boundary point, mm. It is twice the greatest move in the Gauss-Newton step with all axes,
  // which was not taken, plus two standard deviations of the rotation about those axes, given data
  // and prior, at the farthest point.
  // 0 when every axis was estimated; infinite without data and prior.
  double left_out_rotation_mm = 0.0;
  // Posterior covariance of the pose, given sd_mm and the prior: rotation vector (radians) about
  // `centre`, then translation (mm), both in the surface's frame:
  //   true T = rigid_increment(xi, centre) * T_surface_points,  xi ~ N(0, pose_covariance)
  // Axes that the points do not show have the prior's variance. Without a prior they have the
  // variance of pi rad and 1000 mm (pose_information.hpp).
  Mat6 pose_covariance = Mat6::Zero();
  Vec3 centre = Vec3::Zero();   // of the aligned points
  Observability observability;  // in words: not_shown()
  VecX weights;                 // w of each point at the end: near 0 for outliers
};

// points: 3 x m, mm, m >= 3, finite and not collinear. surface: triangles or a distance volume.
// kInvalidArgument: fewer than 3 points (with the count) or collinear ones, an option out of range
// (named), an initial pose that is not a rigid motion. kNotFinite: names the point, or the pose.
// kNotConverged: `stop` was requested. An alignment that uses up its iterations is a result with
// converged == false.
Result<IcpResult> align(const Points& points, const TargetSurface& surface,
                        const RigidTransform& T_surface_points_initial,
                        const IcpOptions& options = {});

}  // namespace brainshift::registration
