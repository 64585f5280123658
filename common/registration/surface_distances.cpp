// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/core/random.hpp"
#include "common/core/statistics.hpp"
#include "common/registration/alignment_data.hpp"

namespace brainshift::registration {
namespace {

// Any fixed number; it makes a replay repeatable.
constexpr std::uint64_t kSubsetSeed = 20090627;

}  // namespace

Result<std::shared_ptr<const IndexedPatch>> IndexedPatch::build(SurfacePatch patch) {
  auto surface = geometry::MovingSurface::build(patch.surface);
  if (!surface) return tl::unexpected(surface.error());
  return std::shared_ptr<const IndexedPatch>(
      new IndexedPatch(std::move(patch), std::move(*surface)));
}

SurfaceDistances::SurfaceDistances(std::shared_ptr<const IndexedPatch> patch,
                                   const SurfaceDistanceOptions& options,
                                   const RigidTransform& T_undeformed_measured)
    : patch_(std::move(patch)), options_(options), T_undeformed_measured_(T_undeformed_measured) {}

Result<SurfaceDistances> SurfaceDistances::build(std::shared_ptr<const IndexedPatch> patch,
                                                 const Points& measured,
                                                 const SurfaceDistanceOptions& options,
                                                 const RigidTransform& T_undeformed_measured) {
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    if (!measured.col(i).allFinite()) {
      return fail(ErrorCode::kNotFinite,
                  fmt::format("{}: point {} is not finite", options.measured, i));
    }
  }
  SurfaceDistances made(std::move(patch), options, T_undeformed_measured);
  std::vector<int> over;
  const Points vertices = made.first_vertices();
  const double sd_mm = std::hypot(options.sd_mm, options.shared_sd_mm);
  const SparseData data =
      made.measure(vertices, measured, VecX::Constant(measured.cols(), sd_mm), &over);
  if (static_cast<int>(over.size()) < options.fewest) {
    const Vec3 centre = vertices.rowwise().mean();
    const double away = measured.cols() > 0 ? (measured.rowwise().mean() - centre).norm() : 0.0;
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} of {} points lie over the {} within {} mm, at least {} are "
                            "needed; their mean lies {:.1f} mm from its centre",
                            options.measured, over.size(), measured.cols(), options.surface,
                            options.farthest_mm, options.fewest, away));
  }
  std::vector<int> guiding =
      Random(kSubsetSeed).choose(options.points, static_cast<int>(over.size()));
  std::sort(guiding.begin(), guiding.end());
  made.guiding_.resize(3, static_cast<Eigen::Index>(guiding.size()));
  for (std::size_t i = 0; i < guiding.size(); ++i) {
    made.guiding_.col(static_cast<Eigen::Index>(i)) =
        measured.col(over[static_cast<std::size_t>(guiding[i])]);
  }
  made.sd_mm_ = VecX::Constant(made.guiding_.cols(), sd_mm);
  if (options.average_mm > 0.0) made.average(data, guiding);
  return made;
}

void SurfaceDistances::average(const SparseData& data, const std::vector<int>& guiding) {
  const Points centres = data.positions(Eigen::all, guiding);
  const double farthest = options_.average_mm * options_.average_mm;
  std::vector<std::vector<double>> distances(guiding.size());
  VecX away(centres.cols());  // squared
  for (Eigen::Index i = 0; i < data.positions.cols(); ++i) {
    Eigen::Index nearest = 0;
    const Vec3 place = data.positions.col(i);
    away = (centres.colwise() - place).colwise().squaredNorm().transpose();
    if (away.minCoeff(&nearest) > farthest) continue;
    distances[static_cast<std::size_t>(nearest)].push_back(
        data.directions.col(i).dot(data.displacements.col(i)));
  }
  for (std::size_t i = 0; i < guiding.size(); ++i) {
    if (distances[i].size() < kFewestAveraged) continue;
    const auto own = static_cast<Eigen::Index>(i);
    const Vec3 n = data.directions.col(guiding[i]);
    const double median = percentile(distances[i], 50.0);
    guiding_.col(own) += (median - n.dot(data.displacements.col(guiding[i]))) * n;
    const double of_median = options_.sd_mm * std::sqrt(0.5 * std::numbers::pi /
                                                        static_cast<double>(distances[i].size()));
    sd_mm_[own] = std::hypot(of_median, options_.shared_sd_mm);
  }
}

Points SurfaceDistances::first_vertices() const {
  const RigidTransform T_measured_undeformed = T_undeformed_measured_.inverse();
  return (T_measured_undeformed.linear() * patch_->patch().surface.vertices).colwise() +
         Vec3(T_measured_undeformed.translation());
}

SparseData SurfaceDistances::measure(Points vertices, const Points& measured, const VecX& sd_mm,
                                     std::vector<int>* kept) const {
  SparseData data;
  if (!vertices.allFinite()) return data;  // of an estimate that failed: no datum
  const geometry::MovedSurface deformed(patch_->surface(), std::move(vertices));
  data.positions.resize(3, measured.cols());
  data.displacements.resize(3, measured.cols());
  data.directions.resize(3, measured.cols());
  data.sd_mm.resize(measured.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    const Vec3 p = measured.col(i);
    const geometry::SurfacePlace closest = deformed.closest(p);
    if (!(closest.distance_mm <= options_.farthest_mm) || deformed.on_rim(closest)) continue;
    const Vec3 n = deformed.normal(closest);
    if (n.squaredNorm() < 0.5)
      continue;  // folded to nothing: zero would stand for a whole displacement
    const Vec3 x = deformed.point_at_rest(closest);
    data.positions.col(count) = x;
    data.directions.col(count) = n;
    data.displacements.col(count) = n.dot(p - x) * n;
    data.sd_mm[count] = sd_mm[i];
    if (kept != nullptr) kept->push_back(static_cast<int>(i));
    ++count;
  }
  data.positions.conservativeResize(3, count);
  data.displacements.conservativeResize(3, count);
  data.directions.conservativeResize(3, count);
  data.sd_mm.conservativeResize(count);
  data.common_error = pose_errors(data.positions, options_.pose_sd_mm, options_.pose_sd_deg);
  return data;
}

SparseData SurfaceDistances::first() const {
  return measure(first_vertices(), guiding_, sd_mm_, nullptr);
}

SparseData SurfaceDistances::at(const Points& u) const {
  const SurfacePatch& patch = patch_->patch();
  return measure(patch.surface.vertices + u * patch.weights, guiding_, sd_mm_, nullptr);
}

bool SurfaceDistances::moved(const SparseData& before, const SparseData& now) const {
  if (before.size() != now.size()) return true;
  for (int i = 0; i < now.size(); ++i) {
    const Vec3 way = now.positions.col(i) - before.positions.col(i);
    if (std::abs(before.directions.col(i).dot(way)) > options_.settled_mm ||
        way.norm() > options_.settled_along_mm) {
      return true;
    }
  }
  return false;
}

}  // namespace brainshift::registration
