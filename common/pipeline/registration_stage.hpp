// SPDX-License-Identifier: GPL-3.0-or-later
// First stage: Observation -> SparseData.
//
//   TumourBoundary   ICP of at most kMostAligned points, spread at random, to the undeformed tumour
//                    surface (paper 2.7), from the tracked pose; then a random subset of
//                    inversion.sparse_points of them (paper 2.6), always the same one for the same
//                    number of points. scene.rotation = off: translation only; on: about every
//                    axis, however little the points show of it. By sensing.tumour:
//                    distances  along the normal of the model's tumour, made anew for every
//                               estimate (registration/surface_distances.hpp; method condensed).
//                               The pose is where they start; it tells gross outliers too
//                    rigid      displacements by the pose, with its errors (other methods)
//   LandmarkPairs    displacement = deformed - undeformed, all pairs; of more than kMostLandmarks
//                    (method condensed) those within kOneFeature_mm count as one, their mean,
//                    since they share their error; then the means of so many groups, with the
//                    standard deviation of a mean. sensing.landmark_pose_sd_mm and _deg are a
//                    common error: misregistration of the image during surgery
//   CorticalSurface  sensing.surface_points of its vertices over the craniotomy (of at most
//                    kMostMeasured of all), chosen likewise, and by sensing.surface:
//                    distances  along the normal of the model's cortex, made anew for every
//                               estimate (registration/surface_distances.hpp; method condensed)
//                    rigid      ICP to the undeformed cortex under the craniotomy, as for the
//                               tumour (other methods)
//                    Rejected: scene.surface = off, and what check_cortical_surface rejects (units,
//                    place, orientation)
//   PatientPose      rejected: not assimilated in this version
//
// Standard deviation of a datum: inversion.sigma_mm, the sigma_eps of the paper's W_eps, or the
// observation's own where that is larger. Distances of a tumour boundary stand for their neighbours
// within sensing.boundary_average_mm, whose noise they average, and add the square of
// sensing.boundary_error_sd_mm to what is left of its square. The paper's method and its variants
// take the former whatever the observation says. Points that ICP takes for outliers guide nothing.
// Errors that aligned points have in common: registration::sparse_data_from_alignment.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/surface_check.hpp"
#include "common/registration/icp.hpp"
#include "common/registration/surface_distances.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::pipeline {

// As many as guide an estimate for a surface (registration/surface_distances.hpp).
inline constexpr int kMostLandmarks = 300;
// Nearer pairs are taken to be of one feature, found once. Chosen, not measured.
inline constexpr double kOneFeature_mm = 2.0;
// More do not make an alignment better: what neighbouring points are off by alike remains.
inline constexpr int kMostAligned = 5000;
// Of a surface, of which a part alone lies over the craniotomy.
inline constexpr int kMostMeasured = 20000;

struct RegisteredObservation {
  std::string source;
  std::uint64_t sequence = 0;
  std::int64_t acquired_ns = 0;
  SparseData data;                                        // empty with `surface`
  int outliers = 0;                                       // points that the alignment left aside
  std::optional<registration::IcpResult> icp;             // when the observation had to be aligned
  std::optional<registration::SurfaceDistances> surface;  // data that follow the deformation
};

// What observations are registered to: the undeformed patient.
struct RegistrationTargets {
  // kEmptySet or kNotFinite when the model has no usable tumour surface.
  static Result<RegistrationTargets> build(const BrainModel& model);

  std::shared_ptr<const registration::IndexedPatch> tumour;
  // The same by interpolation, some thirty times faster. Models whose tumour is not closed have
  // none.
  std::optional<geometry::DistanceVolume> tumour_distance;
  // Null where the model has no triangle there: no cortical surface is taken.
  std::shared_ptr<const registration::IndexedPatch> craniotomy;
  std::optional<geometry::CorticalSite> site;
};

// kInvalidArgument: a body that is not assimilated, landmark counts that differ, fewer than 3
// points. The sentence names the observation and the count. Precondition: the observation's numbers
// are finite, as wire::decode_observation gives them. (Data that are not are rejected further on,
// by check_data or by registration, with kNotFinite.) The result refers to nothing of the targets
// but what it shares. kNotConverged: `stop` was requested meanwhile.
Result<RegisteredObservation> register_observation(const Observation& observation,
                                                   const RegistrationTargets& targets,
                                                   const CaseConfig& config,
                                                   Method method = Method::kCondensed,
                                                   const std::stop_token& stop = {});

}  // namespace brainshift::pipeline
