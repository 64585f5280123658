// SPDX-License-Identifier: GPL-3.0-or-later
// What distances r_i with gradients g_i and weights w_i tell about a small rigid motion of the
// points x_i: the Gauss-Newton normal equations of sum_i w_i (r_i + J_i xi)^2 / sd^2, and their
// consequences.
//
// Coordinates: xi = (radius * w, t). w is a rotation vector about the points' centre c, radius
// their rms distance from it, so that all six are in mm:  J_i = ((x_i - c) x g_i / radius, g_i).
#pragma once

#include <string>
#include <vector>

#include "common/core/small_matrices.hpp"
#include "common/geometry/distance_volume.hpp"

namespace brainshift::registration {

// Small rigid motions about a centre c, and how a distance changes with them.
//
//   T(xi) x = c + exp([w]x) (x - c) + t,      xi = (w, t): rotation vector (rad), translation (mm)
//   d/dxi  n . T(xi) x  at xi = 0   =   ((x - c) x n,  n)
//
// T(xi), mm.
RigidTransform rigid_increment(const Vec6& xi, const Vec3& centre);

// Rotation vector w with exp([w]x) = rotation, |w| <= pi.
Vec3 rotation_vector(const Mat3& rotation);

// Gradient of n . T(xi) x at xi = 0, for a fixed direction n: mm per radian, and no unit.
Vec6 direction_gradient(const Vec3& x, const Vec3& n, const Vec3& centre);

// Which rotations and translations of a pose the points show, in numbers and in words.
//
// A ratio is the information about an axis divided by that about the best known of all six
// (rotation scaled by the points' rms radius). A ratio of 1e-2 means that the axis is known ten
// times worse.
// Ratios of rotations hold with the translation unknown. Ratios of translations hold with the
// rotation known: where one can be traded against the other, the translation does the work.
struct Observability {
  // Ratios ascend, no unit. Column k of the axes belongs to ratio k: unit vectors in the surface's
  // frame.
  Vec3 rotation_ratios = Vec3::Zero();
  Mat3 rotation_axes = Mat3::Identity();
  Vec3 translation_ratios = Vec3::Zero();
  Mat3 translation_axes = Mat3::Identity();
  double threshold = 0.0;  // ratios below it are not observable

  bool rotation_shown(int k) const { return rotation_ratios[k] >= threshold; }
  bool translation_shown(int k) const { return translation_ratios[k] >= threshold; }
};

// One sentence per axis that is not observable: "rotation about (0.10, 0.90, 0.20) is not shown by
// the points". Where none of three is observable, one sentence for all: "no rotation is shown by
// the points". The largest component of an axis is positive. Empty when all are shown.
std::vector<std::string> not_shown(const Observability& seen);

struct PoseInformation {
  Mat6 hessian = Mat6::Zero();   // mm^-2
  Vec6 gradient = Vec6::Zero();  // of half the sum, mm^-1
  Vec3 centre = Vec3::Zero();    // c, mm
  double radius_mm = 1.0;
};

// points, gradients: m x 3; residuals (mm), weights: m. Does not allocate. The order of summation
// depends on the number of points alone.
PoseInformation pose_information(const geometry::PointRows& points,
                                 const geometry::PointRows& gradients, const VecX& residuals,
                                 const VecX& weights, double sd_mm, const Vec3& centre,
                                 double radius_mm);

// Information about the rotation with the translation unknown: the Schur complement, 3 x 3, mm^-2.
Mat3 rotation_information(const Mat6& hessian);

// An axis with less than `ratio` of the Hessian's largest eigenvalue is not observable.
Observability observability(const PoseInformation& information, double ratio);

// Standard deviations of an axis without any information: half a turn, and a metre.
inline constexpr double kUnknownRotationSd_rad = 3.14159265358979323846;
inline constexpr double kUnknownTranslationSd_mm = 1000.0;

// Covariance of (w, t), radians and mm, about the centre: the inverse of the points' information
// plus the prior's. rotation_prior: 1 / variance of each rotation axis, rad^-2; 0: no prior.
// Rotation axes that are not observable (all of them unless `rotates`) are known from the prior
// alone, and their effect on the translation is kept. Translation axes that are not observable
// have the standard deviation above.
Mat6 pose_covariance(const PoseInformation& information, const Observability& seen, bool rotates,
                     double rotation_prior);

}  // namespace brainshift::registration
