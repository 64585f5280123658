// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/random.hpp"
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
  made.measure(vertices, measured, &over);
  if (static_cast<int>(over.size()) < options.fewest) {
    const Vec3 centre = vertices.rowwise().mean();
    const double away = measured.cols() > 0 ? (measured.rowwise().mean() - centre).norm() : 0.0;
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} of {} points lie over the {} within {} mm, at least {} are "
                            "needed; their mean lies {:.1f} mm from its centre",
                            options.measured, over.size(), measured.cols(), options.surface,
                            options.farthest_mm, options.fewest, away));
  }
  const int available = static_cast<int>(over.size());
  if (available > options.points) {
    std::vector<int> chosen = Random(kSubsetSeed).choose(options.points, available);
    std::sort(chosen.begin(), chosen.end());
    for (int& one : chosen) one = over[static_cast<std::size_t>(one)];
    over = std::move(chosen);
  }
  made.guiding_ = measured(Eigen::all, over);
  return made;
}

Points SurfaceDistances::first_vertices() const {
  const RigidTransform T_measured_undeformed = T_undeformed_measured_.inverse();
  return (T_measured_undeformed.linear() * patch_->patch().surface.vertices).colwise() +
         Vec3(T_measured_undeformed.translation());
}

SparseData SurfaceDistances::measure(Points vertices, const Points& measured,
                                     std::vector<int>* kept) const {
  SparseData data;
  if (!vertices.allFinite()) return data;  // of an estimate that failed: no datum
  const geometry::MovedSurface deformed(patch_->surface(), std::move(vertices));
  data.positions.resize(3, measured.cols());
  data.displacements.resize(3, measured.cols());
  data.directions.resize(3, measured.cols());
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
    if (kept != nullptr) kept->push_back(static_cast<int>(i));
    ++count;
  }
  data.positions.conservativeResize(3, count);
  data.displacements.conservativeResize(3, count);
  data.directions.conservativeResize(3, count);
  data.sd_mm = VecX::Constant(count, options_.sd_mm);
  data.common_error = pose_errors(data.positions, options_.pose_sd_mm, options_.pose_sd_deg);
  return data;
}

SparseData SurfaceDistances::first() const { return measure(first_vertices(), guiding_, nullptr); }

SparseData SurfaceDistances::at(const Points& u) const {
  const SurfacePatch& patch = patch_->patch();
  return measure(patch.surface.vertices + u * patch.weights, guiding_, nullptr);
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
