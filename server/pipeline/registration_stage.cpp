// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/pipeline/registration_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/core/random.hpp"

namespace brainshift::server {
namespace {

// Any fixed number; it makes a replay repeatable.
constexpr std::uint64_t kSubsetSeed = 20090627;

// Ascending, so that neighbouring data stay neighbours; the same for the same number of points.
std::vector<int> guiding_points(int available, int wanted) {
  std::vector<int> chosen = Random(kSubsetSeed).choose(wanted, available);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

SparseData select(const SparseData& data, const std::vector<int>& columns) {
  const auto size = static_cast<Eigen::Index>(columns.size());
  SparseData subset;
  subset.positions.resize(3, size);
  subset.displacements.resize(3, size);
  subset.sd_mm.resize(size);
  subset.common_error.resize(data.common_error.rows() > 0 ? 3 * size : 0, data.common_error.cols());
  for (Eigen::Index i = 0; i < size; ++i) {
    const int column = columns[static_cast<std::size_t>(i)];
    subset.positions.col(i) = data.positions.col(column);
    subset.displacements.col(i) = data.displacements.col(column);
    subset.sd_mm(i) = data.sd_mm(column);
    if (subset.common_error.rows() > 0) {
      subset.common_error.middleRows<3>(3 * i) = data.common_error.middleRows<3>(3 * column);
    }
  }
  return subset;
}

double datum_sd_mm(double observed_mm, const InversionConfig& config, Method method) {
  const bool condensed = method == Method::kCondensed || method == Method::kCondensedExact;
  return condensed ? std::max(observed_mm, config.sigma_mm) : config.sigma_mm;
}

Result<RegisteredObservation> from_tumour_boundary(const TumourBoundary& boundary,
                                                   const geometry::ClosestPointIndex& tumour,
                                                   const CaseConfig& config, Method method) {
  registration::IcpOptions options;
  options.rotation = config.scene.rotation != Carry::kOff;
  if (config.scene.rotation == Carry::kOn) options.observability_ratio = 0.0;
  if (boundary.sd_mm > 0.0) options.sd_mm = boundary.sd_mm;
  // The points arrive tracked, in patient RAS, so the identity is the tracked pose.
  auto icp = registration::align(boundary.points, tumour, RigidTransform::Identity(), options);
  if (!icp) return tl::unexpected(icp.error());
  const SparseData all = registration::sparse_data_from_alignment(
      boundary.points, icp->T_surface_points,
      datum_sd_mm(boundary.sd_mm, config.inversion, method));
  RegisteredObservation registered;
  registered.data = select(all, guiding_points(all.size(), config.inversion.sparse_points));
  registered.icp = *icp;
  return registered;
}

Result<RegisteredObservation> from_landmarks(const LandmarkPairs& pairs,
                                             const InversionConfig& config, Method method) {
  if (pairs.undeformed.cols() != pairs.deformed.cols()) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("landmark_pairs: {} undeformed but {} deformed points",
                            pairs.undeformed.cols(), pairs.deformed.cols()));
  }
  if (pairs.undeformed.cols() < 3) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("landmark_pairs: {} pairs, at least 3 are needed", pairs.undeformed.cols()));
  }
  if (!pairs.undeformed.allFinite() || !pairs.deformed.allFinite()) {
    return fail(ErrorCode::kNotFinite, "landmark_pairs: a coordinate is not finite");
  }
  RegisteredObservation registered;
  registered.data.positions = pairs.undeformed;
  registered.data.displacements = pairs.deformed - pairs.undeformed;
  registered.data.sd_mm =
      VecX::Constant(pairs.undeformed.cols(), datum_sd_mm(pairs.sd_mm, config, method));
  return registered;
}

}  // namespace

Result<RegisteredObservation> register_observation(const Observation& observation,
                                                   const geometry::ClosestPointIndex& tumour,
                                                   const CaseConfig& config, Method method) {
  if (const auto* boundary = std::get_if<TumourBoundary>(&observation.body)) {
    return from_tumour_boundary(*boundary, tumour, config, method);
  }
  if (const auto* pairs = std::get_if<LandmarkPairs>(&observation.body)) {
    return from_landmarks(*pairs, config.inversion, method);
  }
  const bool surface = std::holds_alternative<CorticalSurface>(observation.body);
  if (surface && config.scene.surface == Carry::kOff) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation {}: scene.surface = off: a cortical_surface is not taken",
                            observation.sequence));
  }
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("observation {}: a {} is not assimilated in this version",
                          observation.sequence, surface ? "cortical_surface" : "patient_pose"));
}

}  // namespace brainshift::server
