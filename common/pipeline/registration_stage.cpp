// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/registration_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "common/core/random.hpp"
#include "common/core/statistics.hpp"
#include "common/geometry/node_choice.hpp"
#include "common/registration/alignment_data.hpp"

namespace brainshift::pipeline {
namespace {

// Any fixed number; it makes a replay repeatable.
constexpr std::uint64_t kSubsetSeed = 20090627;

// Welsch weight exp(-r^2 / 2 s^2) of a point two scales off. A point with less lies on something
// else.
const double kMinWelschWeight = std::exp(-2.0);

// The scale of a Welsch kernel in units of the median residual (2.7 standard deviations of a
// Gaussian, whose median is 0.6745) and, at least, of the points' own standard deviation: either
// way the estimate keeps 98 % of the efficiency that least squares has for Gaussian errors, (1 +
// 1/s^2)^-3 (1 + 2/s^2)^(3/2) (Holland & Welsch 1977, Comm. Stat. A6:813).
constexpr double kScaleOverMedian = 4.0;
constexpr double kScaleOverSd = 3.0;
// A residual of seven scales. Welsch weights underflow far behind it, and a median does not need
// them.
constexpr double kSmallestWelschWeight = 1e-12;
// Points of a boundary that are averaged for each that guides the model.
constexpr int kMeasuredPerPoint = 10;

// Ascending, so that neighbouring data stay neighbours; the same for the same number of points.
std::vector<int> some_of(const std::vector<int>& points, int wanted) {
  std::vector<int> chosen = Random(kSubsetSeed).choose(wanted, static_cast<int>(points.size()));
  std::sort(chosen.begin(), chosen.end());
  for (int& one : chosen) one = points[static_cast<std::size_t>(one)];
  return chosen;
}

SparseData select(const SparseData& data, const std::vector<int>& columns) {
  const auto size = static_cast<Eigen::Index>(columns.size());
  SparseData subset;
  subset.positions = data.positions(Eigen::all, columns);
  subset.displacements = data.displacements(Eigen::all, columns);
  subset.sd_mm = data.sd_mm(columns);
  subset.common_error.resize(data.common_error.rows() > 0 ? 3 * size : 0, data.common_error.cols());
  for (Eigen::Index i = 0; 3 * i < subset.common_error.rows(); ++i) {
    const int column = columns[static_cast<std::size_t>(i)];
    subset.common_error.middleRows<3>(3 * i) = data.common_error.middleRows<3>(3 * column);
  }
  return subset;
}

double datum_sd_mm(double observed_mm, const InversionConfig& config, Method method) {
  return method == Method::kCondensed ? std::max(observed_mm, config.sigma_mm) : config.sigma_mm;
}

// The scale that fits points with these Welsch weights, never wider than the scale they came from.
double fitting_scale_mm(const VecX& weights, const registration::IcpOptions& options) {
  std::vector<double> residuals;
  for (const double weight : weights) {
    residuals.push_back(options.welsch_scale_mm *
                        std::sqrt(-2.0 * std::log(std::max(weight, kSmallestWelschWeight))));
  }
  const double median = percentile(residuals, 50.0);
  const double least = std::min(kScaleOverSd * options.sd_mm, options.welsch_scale_mm);
  return std::clamp(kScaleOverMedian * median, least, options.welsch_scale_mm);
}

struct Alignment {
  registration::IcpResult icp;
  std::vector<int> inliers;  // indices of the points that it holds for, ascending
  int outliers = 0;          // points that the alignment leaves aside
};

// Aligned rigidly from the tracked pose, which is the identity: the points arrive in patient RAS.
Result<Alignment> align(const Points& points, double observed_sd_mm,
                        const registration::TargetSurface& surface, const CaseConfig& config,
                        const std::stop_token& stop) {
  registration::IcpOptions options;
  options.stop = stop;
  options.rotation = config.scene.rotation != Carry::kOff;
  if (config.scene.rotation == Carry::kOn) options.observability_ratio = 0.0;
  if (observed_sd_mm > 0.0) options.sd_mm = observed_sd_mm;
  auto icp = registration::align(points, surface, RigidTransform::Identity(), options);
  if (!icp) return tl::unexpected(icp.error());
  // Again with a scale that fits these points, so that gross errors of a few millimetres count for
  // nothing.
  options.welsch_scale_mm = fitting_scale_mm(icp->weights, options);
  icp = registration::align(points, surface, icp->T_surface_points, options);
  if (!icp) return tl::unexpected(icp.error());
  std::vector<int> inliers;
  for (int i = 0; i < icp->weights.size(); ++i) {
    if (icp->weights[i] >= kMinWelschWeight) inliers.push_back(i);
  }
  if (inliers.size() < 3) {
    return fail(ErrorCode::kNotConverged,
                fmt::format("alignment: {} of {} points lie on the surface after it, at least 3 "
                            "are needed; residual {:.1f} mm",
                            inliers.size(), points.cols(), icp->rms_mm));
  }
  Alignment alignment;
  alignment.outliers = static_cast<int>(points.cols()) - static_cast<int>(inliers.size());
  alignment.inliers = std::move(inliers);
  alignment.icp = std::move(*icp);
  return alignment;
}

// The points, or so many of them; the same for the same number of points.
Points at_most(int wanted, const Points& points) {
  if (points.cols() <= wanted) return points;
  std::vector<int> all(static_cast<std::size_t>(points.cols()));
  std::iota(all.begin(), all.end(), 0);
  return points(Eigen::all, some_of(all, wanted));
}

// Displacements by a rigid alignment (paper 2.7).
RegisteredObservation from_alignment(const Points& points, double sd_mm, Alignment alignment,
                                     int guiding) {
  RegisteredObservation registered;
  registered.data = select(registration::sparse_data_from_alignment(points, alignment.icp, sd_mm),
                           some_of(alignment.inliers, guiding));
  registered.outliers = alignment.outliers;
  registered.icp = std::move(alignment.icp);
  return registered;
}

bool follows_deformation(SurfaceGuidance guidance, Method method) {
  return guidance == SurfaceGuidance::kDistances && method == Method::kCondensed;
}

Result<RegisteredObservation> from_boundary(const TumourBoundary& observed,
                                            const RegistrationTargets& targets,
                                            const CaseConfig& config, Method method,
                                            const std::stop_token& stop) {
  const TumourBoundary body{at_most(kMostAligned, observed.points), observed.sd_mm};
  const auto target = targets.tumour_distance
                          ? registration::TargetSurface(*targets.tumour_distance)
                          : registration::TargetSurface(targets.tumour->surface().at_rest());
  auto alignment = align(body.points, body.sd_mm, target, config, stop);
  if (!alignment) return tl::unexpected(alignment.error());
  const double sd_mm = datum_sd_mm(body.sd_mm, config.inversion, method);
  if (!follows_deformation(config.sensing.tumour, method)) {
    return from_alignment(body.points, sd_mm, std::move(*alignment),
                          config.inversion.sparse_points);
  }
  registration::SurfaceDistanceOptions options;
  options.points = config.inversion.sparse_points;
  options.sd_mm = sd_mm;
  options.shared_sd_mm = config.sensing.boundary_error_sd_mm;
  options.average_mm = config.sensing.boundary_average_mm;
  options.pose_sd_mm = config.sensing.probe_pose_sd_mm;
  options.pose_sd_deg = config.sensing.probe_pose_sd_deg;
  options.outline_errors = config.sensing.boundary_outline_errors;
  options.fewest = 3;
  options.measured = "tumour boundary";
  options.surface = "tumour";
  options.stop = stop;
  const int per_point = options.average_mm > 0.0 ? kMeasuredPerPoint : 1;
  const std::vector<int> used = some_of(alignment->inliers, per_point * options.points);
  auto surface = registration::SurfaceDistances::build(
      targets.tumour, body.points(Eigen::all, used), options, alignment->icp.T_surface_points);
  if (!surface) return tl::unexpected(surface.error());
  RegisteredObservation registered;
  registered.surface = std::move(*surface);
  registered.outliers = alignment->outliers;
  registered.icp = std::move(alignment->icp);
  return registered;
}

Result<RegisteredObservation> from_surface(const CorticalSurface& body,
                                           const RegistrationTargets& targets,
                                           const CaseConfig& config, Method method,
                                           const std::stop_token& stop) {
  if (!targets.site || targets.craniotomy == nullptr) {
    return fail(ErrorCode::kEmptySet,
                "cortical surface: the craniotomy of the model has no triangle to compare it with");
  }
  auto checked = geometry::check_cortical_surface(body.surface, *targets.site);
  if (!checked) return tl::unexpected(checked.error());
  const SensingConfig& sensing = config.sensing;
  const double sd_mm = datum_sd_mm(body.sd_mm, config.inversion, method);
  if (!follows_deformation(sensing.surface, method)) {
    auto alignment = align(body.surface.vertices, body.sd_mm,
                           targets.craniotomy->surface().at_rest(), config, stop);
    if (!alignment) return tl::unexpected(alignment.error());
    return from_alignment(body.surface.vertices, sd_mm, std::move(*alignment),
                          sensing.surface_points);
  }
  registration::SurfaceDistanceOptions options;
  options.points = sensing.surface_points;
  options.sd_mm = sd_mm;
  options.pose_sd_mm = sensing.surface_pose_sd_mm;
  options.pose_sd_deg = sensing.surface_pose_sd_deg;
  options.stop = stop;
  auto surface = registration::SurfaceDistances::build(
      targets.craniotomy, at_most(kMostMeasured, body.surface.vertices), options);
  if (!surface) return tl::unexpected(surface.error());
  RegisteredObservation registered;
  registered.surface = std::move(*surface);
  return registered;
}

// Groups of neighbouring pairs, each the mean of its group: what a displacement that is affine over
// a group says of it.
struct GroupedPairs {
  Points undeformed, displacements;
  VecX count;  // of each group
};

// About these pairs.
GroupedPairs grouped(const Points& undeformed, const Points& displacements,
                     const std::vector<NodeIndex>& centres) {
  const auto groups = static_cast<Eigen::Index>(centres.size());
  const Points places = undeformed(Eigen::all, centres);
  GroupedPairs result{Points::Zero(3, groups), Points::Zero(3, groups), VecX::Zero(groups)};
  for (Eigen::Index i = 0; i < undeformed.cols(); ++i) {
    Eigen::Index nearest = 0;
    (places.colwise() - undeformed.col(i)).colwise().squaredNorm().minCoeff(&nearest);
    result.undeformed.col(nearest) += undeformed.col(i);
    result.displacements.col(nearest) += displacements.col(i);
    result.count[nearest] += 1.0;
  }
  // Places that several share leave a group without any.
  Eigen::Index kept = 0;
  for (Eigen::Index g = 0; g < groups; ++g) {
    if (result.count[g] == 0.0) continue;
    result.undeformed.col(kept) = result.undeformed.col(g) / result.count[g];
    result.displacements.col(kept) = result.displacements.col(g) / result.count[g];
    result.count[kept++] = result.count[g];
  }
  return {result.undeformed.leftCols(kept), result.displacements.leftCols(kept),
          result.count.head(kept)};
}

// The first pair, and each that is farther than kOneFeature_mm from those before it.
std::vector<NodeIndex> features(const Points& undeformed) {
  std::vector<NodeIndex> found;
  for (Eigen::Index i = 0; i < undeformed.cols(); ++i) {
    const auto near = [&](NodeIndex other) {
      return (undeformed.col(other) - undeformed.col(i)).norm() <= kOneFeature_mm;
    };
    if (std::none_of(found.begin(), found.end(), near)) found.push_back(static_cast<NodeIndex>(i));
  }
  return found;
}

Result<RegisteredObservation> from_landmarks(const LandmarkPairs& pairs, const CaseConfig& config,
                                             Method method) {
  if (pairs.undeformed.cols() != pairs.deformed.cols()) {
    return invalid(fmt::format("landmark_pairs: {} undeformed but {} deformed points",
                               pairs.undeformed.cols(), pairs.deformed.cols()));
  }
  if (pairs.undeformed.cols() < 3) {
    return invalid(
        fmt::format("landmark_pairs: {} pairs, at least 3 are needed", pairs.undeformed.cols()));
  }
  RegisteredObservation registered;
  registered.data.positions = pairs.undeformed;
  registered.data.displacements = pairs.deformed - pairs.undeformed;
  registered.data.sd_mm =
      VecX::Constant(pairs.undeformed.cols(), datum_sd_mm(pairs.sd_mm, config.inversion, method));
  if (method == Method::kCondensed && pairs.undeformed.cols() > kMostLandmarks) {
    GroupedPairs groups =
        grouped(pairs.undeformed, registered.data.displacements, features(pairs.undeformed));
    if (groups.undeformed.cols() > kMostLandmarks) {
      groups = grouped(groups.undeformed, groups.displacements,
                       geometry::spread_nodes(groups.undeformed, kMostLandmarks));
    } else {
      groups.count.setOnes();
    }
    registered.data.positions = groups.undeformed;
    registered.data.displacements = groups.displacements;
    registered.data.sd_mm = registered.data.sd_mm[0] * groups.count.cwiseSqrt().cwiseInverse();
  }
  registered.data.common_error =
      registration::pose_errors(registered.data.positions, config.sensing.landmark_pose_sd_mm,
                                config.sensing.landmark_pose_sd_deg);
  return registered;
}

}  // namespace

Result<RegistrationTargets> RegistrationTargets::build(const BrainModel& model) {
  RegistrationTargets targets;
  auto tumour = registration::IndexedPatch::build(registration::tumour_patch(model));
  if (!tumour) return tl::unexpected(tumour.error());
  targets.tumour = std::move(*tumour);
  if (auto distance = geometry::DistanceVolume::create(model.tumour_distance)) {
    targets.tumour_distance = std::move(*distance);
  }
  if (auto patch = registration::IndexedPatch::build(registration::craniotomy_patch(model))) {
    targets.craniotomy = std::move(*patch);
  }
  if (const auto site = geometry::craniotomy_site(model)) targets.site = *site;
  return targets;
}

Result<RegisteredObservation> register_observation(const Observation& observation,
                                                   const RegistrationTargets& targets,
                                                   const CaseConfig& config, Method method,
                                                   const std::stop_token& stop) {
  Result<RegisteredObservation> registered = invalid(fmt::format(
      "observation {}: a patient_pose is not assimilated in this version", observation.sequence));
  if (const auto* boundary = std::get_if<TumourBoundary>(&observation.body)) {
    registered = from_boundary(*boundary, targets, config, method, stop);
  } else if (const auto* pairs = std::get_if<LandmarkPairs>(&observation.body)) {
    registered = from_landmarks(*pairs, config, method);
  } else if (const auto* surface = std::get_if<CorticalSurface>(&observation.body)) {
    if (config.scene.surface == Carry::kOff) {
      return invalid(
          fmt::format("observation {}: scene.surface = off: a cortical_surface is not taken",
                      observation.sequence));
    }
    registered = from_surface(*surface, targets, config, method, stop);
  }
  if (!registered) return registered;
  registered->source = observation.source;
  registered->sequence = observation.sequence;
  registered->acquired_ns = observation.acquired_ns;
  registered->data.sources = {{observation.source, 0, registered->data.size()}};
  return registered;
}

}  // namespace brainshift::pipeline
