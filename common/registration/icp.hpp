// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid iterative closest point from boundary points to a surface (paper 2.7; Besl & McKay 1992, with the
// point-to-plane error of Chen & Medioni 1992, Welsch weights and a Gaussian rotation prior).
//
//   min over T   sum_i rho(r_i) / sd^2  +  |rotation angle(T T_initial^-1)|^2 / rotation_sd^2
//   rho(r) = 2 s^2 (1 - exp(-r^2 / 2 s^2)),  weight w(r) = rho'(r) / 2r = exp(-r^2 / 2 s^2)
//   r_i = distance of T p_i from the surface, n_i its gradient:
//     triangles  q_i closest surface point, n_i the direction from q_i to T p_i: the triangle's normal (up to sign),
//                and at an edge or vertex the one of its normals that points there; exact, about 1 us a point
//     volume     interpolated (geometry/distance_volume.hpp): off by hundredths of a millimetre, some 10 ns a point
//     cloud      along the normal of the closest measured point (geometry/oriented_cloud.hpp)
//
// As n_i is the gradient of r_i, each Gauss-Newton step can be checked against the objective: it is halved until the
// objective goes down. The scale s starts at twice the median distance and shrinks to welsch_scale_mm, which widens
// the basin of convergence.
// Rotation is about the centroid of the points, so that rotation and translation decouple.
//
// Axes that the data do not show (a sphere has no rotation) take no step from the data at all: there the
// pose stays at the initial one, or goes where the prior draws it.
// The prior is a standard deviation against that of *independent* points: where few points guide the
// rotation it draws towards the initial pose, by design.
//
// Assumption: point errors are independent with standard deviation sd_mm along the surface normal.
#pragma once

#include "common/core/error.hpp"
#include "common/values/sparse_data.hpp"
#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/oriented_cloud.hpp"
#include "common/registration/observability.hpp"
#include "common/registration/rigid_increment.hpp"

namespace brainshift::registration {

struct IcpOptions {
  int max_iterations = 50;
  double sd_mm = 0.5;            // of a boundary point along the normal
  double welsch_scale_mm = 3.0;  // s: residual at which a point's weight falls to exp(-1/2)
  double rotation_sd_deg = 3.0;  // prior; <= 0 switches it off
  bool rotation = true;          // false: translation only
  double translation_tolerance_mm = 1e-4;
  double rotation_tolerance_deg = 1e-4;
  // An axis whose Hessian eigenvalue (data only, rotation scaled by the point cloud's rms radius) is below
  // this fraction of the largest is reported unobservable. At 1e-2 it is known ten times worse than the best
  // axis. Measured for the least visible rotation: 4.6e-4 for the facets of a sphere of 2,562 vertices,
  // 3e-3 for semi-axes of 14, 13 and 20 mm, 2.6e-2 for 14, 11 and 20 mm.
  double observability_ratio = 1e-2;
};

struct IcpResult {
  RigidTransform T_surface_points = RigidTransform::Identity();  // x_surface = T x_points
  bool converged = false;
  int iterations = 0;
  double rms_mm = 0.0;      // of the residuals at the end, weighted by w
  int observable_axes = 0;  // of 6
  // All three rotation axes, the translation being unknown too.
  bool rotation_observable = false;
  // What rotation axes that took no step from the data (switched off, or not observable) may move a boundary
  // point, mm: twice the greatest move in the Gauss-Newton step with all axes that was not taken, plus two
  // standard deviations of the rotation about those axes, given data and prior, at the farthest point.
  // 0 when every axis was estimated; infinite without data and prior.
  double left_out_rotation_mm = 0.0;
  // Posterior covariance of the pose: rotation vector (radians) about `centre`, then translation (mm), both in
  // the surface's frame: true T = rigid_increment(xi, centre) * T_surface_points, xi ~ N(0, pose_covariance).
  // Given sd_mm and the prior; axes that the points do not show have the prior's variance, or where there is
  // none that of pi rad and 1000 mm (pose_information.hpp).
  Mat6 pose_covariance = Mat6::Zero();
  Vec3 centre = Vec3::Zero();   // of the aligned points
  Observability observability;  // in words: not_shown()
  VecX weights;                 // w of each point at the end: near 0 for outliers
};

// points: 3 x m, m >= 3 and not collinear, finite; else kInvalidArgument / kNotFinite naming the count.
// kInvalidArgument also for an option out of range (named) and an initial pose that is no rigid motion.
// An alignment that runs out of iterations is a result with converged == false.
Result<IcpResult> align(const Points& points, const geometry::ClosestPointIndex& surface,
                        const RigidTransform& T_surface_points_initial,
                        const IcpOptions& options = {});
Result<IcpResult> align(const Points& points, const geometry::DistanceVolume& surface,
                        const RigidTransform& T_surface_points_initial,
                        const IcpOptions& options = {});
Result<IcpResult> align(const Points& points, const geometry::OrientedCloud& surface,
                        const RigidTransform& T_surface_points_initial,
                        const IcpOptions& options = {});

// What a rigid alignment of a deformed boundary leaves in common to all its points, beside the error of its pose: the
// strain that it takes for none. Brain shifts by millimetres over some 100 mm: a few per cent.
inline constexpr double kAlignmentStrainSd = 0.1;

// Paper 2.7: displacement of each boundary point = its tracked (deformed) place minus its place after the
// transform (undeformed). positions = T p, displacements = p - T p, each with standard deviation sd_mm.
// common_error, by column: the axes of pose_covariance, with rotations of rotation_sd_deg, the prior's, in place of what
// independent points seem to know of them (a deformed, smooth boundary shows less), as they are if it is <= 0; and six
// strains, all about the points' centroid.
SparseData sparse_data_from_alignment(const Points& points, const IcpResult& icp, double sd_mm,
                                      double rotation_sd_deg = IcpOptions{}.rotation_sd_deg);

}  // namespace brainshift::registration
