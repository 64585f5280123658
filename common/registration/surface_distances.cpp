// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/registration/alignment_data.hpp"

namespace brainshift::registration {

SurfacePatch craniotomy_patch(const BrainModel& model) {
  SurfacePatch patch;
  patch.nodes = model.craniotomy;
  std::sort(patch.nodes.begin(), patch.nodes.end());
  patch.surface =
      geometry::surface_between(model.mesh.nodes, model.boundary_triangles, patch.nodes);
  const auto count = static_cast<Eigen::Index>(patch.nodes.size());
  patch.weights.resize(count, count);
  patch.weights.setIdentity();
  return patch;
}

SurfacePatch tumour_patch(const BrainModel& model) {
  SurfacePatch patch;
  patch.surface = model.tumour;
  const geometry::TetLocator locator(model.mesh);
  std::vector<geometry::TetLocation> carriers;
  std::map<NodeIndex, int> rows;  // ascending
  for (const auto vertex : model.tumour.vertices.colwise()) {
    carriers.push_back(locator.locate(vertex));
    for (const int node : carriers.back().nodes) rows[node] = 0;
  }
  for (auto& [node, row] : rows) {
    row = static_cast<int>(patch.nodes.size());
    patch.nodes.push_back(node);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t v = 0; v < carriers.size(); ++v) {
    for (int k = 0; k < 4; ++k) {
      entries.emplace_back(rows[carriers[v].nodes[k]], static_cast<int>(v), carriers[v].weights[k]);
    }
  }
  patch.weights.resize(static_cast<Eigen::Index>(patch.nodes.size()),
                       static_cast<Eigen::Index>(carriers.size()));
  patch.weights.setFromTriplets(entries.begin(), entries.end());
  return patch;
}

namespace {

// Any fixed number; it makes a replay repeatable.
constexpr std::uint64_t kSubsetSeed = 20090627;

constexpr int kBetweenStops = 1024;  // points
constexpr int kTrend = 12;           // coefficients of an affine displacement
constexpr int kTrendRounds = 4;      // of robust weights
constexpr double kHuber = 1.345;
// Of the mean diagonal: what no distance shows, such as a turn of a ball, stays zero.
constexpr double kRidge = 1e-6;

// n . (a + B x) is what an affine displacement makes of the distances: its row for one datum.
// Lengths in units of `size`.
Eigen::Matrix<double, kTrend, 1> trend_row(const Vec3& n, const Vec3& x, double size) {
  Eigen::Matrix<double, kTrend, 1> row;
  row.head<3>() = n;
  for (int k = 0; k < 3; ++k) row.segment<3>(3 + 3 * k) = (x[k] / size) * n;
  return row;
}

// What the affine displacement that explains the distances best leaves of them, by Huber's weights
// (1964, Ann. Math. Stat. 35:73); gross errors hardly move it.
VecX without_trend(const SparseData& data) {
  const Eigen::Index count = data.positions.cols();
  VecX left = (data.directions.array() * data.displacements.array()).colwise().sum().transpose();
  const VecX distances = left;
  const Vec3 centre = data.positions.rowwise().mean();
  const double size =
      std::max(1.0, std::sqrt((data.positions.colwise() - centre).colwise().squaredNorm().mean()));
  Eigen::MatrixXd rows(kTrend, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    rows.col(i) = trend_row(data.directions.col(i), data.positions.col(i) - centre, size);
  }
  VecX weights = VecX::Ones(count);
  for (int round = 0; round < kTrendRounds; ++round) {
    Eigen::Matrix<double, kTrend, kTrend> normal = rows * weights.asDiagonal() * rows.transpose();
    normal.diagonal().array() += kRidge * std::max(1e-300, normal.trace() / kTrend);
    const Eigen::Matrix<double, kTrend, 1> right = rows * weights.cwiseProduct(distances);
    const Eigen::Matrix<double, kTrend, 1> trend = normal.ldlt().solve(right);
    left = distances - rows.transpose() * trend;
    const VecX sizes = left.cwiseAbs();
    const double sd = 1.4826 * percentile({sizes.data(), static_cast<std::size_t>(count)}, 50.0);
    if (!(sd > 0.0)) break;
    weights = (kHuber * sd / sizes.array().max(kHuber * sd)).matrix();
  }
  return left;
}

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
  if (options.stop.stop_requested()) {
    return fail(ErrorCode::kNotConverged, options.measured + ": was stopped");
  }
  if (static_cast<int>(over.size()) < options.fewest) {
    const Vec3 centre = vertices.rowwise().mean();
    const double away = measured.cols() > 0 ? (measured.rowwise().mean() - centre).norm() : 0.0;
    return invalid(
        fmt::format("{}: {} of {} points lie over the {} within {} mm, at least {} are "
                    "needed; their mean lies {:.1f} mm from its centre",
                    options.measured, over.size(), measured.cols(), options.surface,
                    kFarthestPoint_mm, options.fewest, away));
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
  if (options.outline_errors) made.outline_ = outline_errors(data.positions(Eigen::all, guiding));
  if (options.average_mm > 0.0) made.average(data, guiding);
  made.options_.stop = {};
  return made;
}

void SurfaceDistances::average(const SparseData& data, const std::vector<int>& guiding) {
  const Points centres = data.positions(Eigen::all, guiding);
  const double farthest = options_.average_mm * options_.average_mm;
  const VecX left = without_trend(data);
  std::vector<std::vector<double>> distances(guiding.size());
  VecX away(centres.cols());  // squared
  for (Eigen::Index i = 0; i < data.positions.cols(); ++i) {
    Eigen::Index nearest = 0;
    const Vec3 place = data.positions.col(i);
    away = (centres.colwise() - place).colwise().squaredNorm().transpose();
    if (away.minCoeff(&nearest) > farthest) continue;
    distances[static_cast<std::size_t>(nearest)].push_back(left[i]);
  }
  for (std::size_t i = 0; i < guiding.size(); ++i) {
    if (distances[i].size() < kFewestAveraged) continue;
    const auto own = static_cast<Eigen::Index>(i);
    const Vec3 n = data.directions.col(guiding[i]);
    const double median = percentile(distances[i], 50.0);
    guiding_.col(own) += (median - left[guiding[i]]) * n;
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
    if (i % kBetweenStops == 0 && options_.stop.stop_requested()) break;
    const Vec3 p = measured.col(i);
    const geometry::SurfacePlace closest = deformed.closest(p);
    if (!(closest.distance_mm <= kFarthestPoint_mm) || deformed.on_rim(closest)) continue;
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

SparseData SurfaceDistances::first() const { return measure_guiding(first_vertices()); }

SparseData SurfaceDistances::measure_guiding(Points vertices) const {
  std::vector<int> kept;
  SparseData data = measure(std::move(vertices), guiding_, sd_mm_, &kept);
  const Eigen::Index errors = outline_.columns.cols(), size = data.size();
  if (errors == 0 || size == 0) return data;
  const Eigen::Index pose = data.common_error.cols();
  data.common_error.conservativeResize(3 * size, pose + errors);
  for (Eigen::Index i = 0; i < size; ++i) {
    data.common_error.block(3 * i, pose, 3, errors) =
        data.directions.col(i) * outline_.columns.row(kept[static_cast<std::size_t>(i)]);
  }
  data.common_variance.setOnes(pose + errors, outline_.variances.cols());
  data.common_variance.bottomRows(errors) = outline_.variances;
  return data;
}

SparseData SurfaceDistances::at(const Points& u) const {
  const SurfacePatch& patch = patch_->patch();
  return measure_guiding(patch.surface.vertices + u * patch.weights);
}

bool SurfaceDistances::moved(const SparseData& before, const SparseData& now) const {
  if (before.size() != now.size()) return true;
  for (int i = 0; i < now.size(); ++i) {
    const Vec3 way = now.positions.col(i) - before.positions.col(i);
    if (std::abs(before.directions.col(i).dot(way)) > kSettled_mm ||
        way.norm() > kSettledAlong_mm) {
      return true;
    }
  }
  return false;
}

VecX signed_projection_distance(const Points& nodes, const geometry::ClosestPointIndex& surface) {
  VecX distances(nodes.cols());
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    const Vec3 node = nodes.col(i);
    const geometry::ClosestPoint closest = surface.closest(node);
    const double outwards = (node - closest.point).dot(surface.pseudo_normal(closest));
    distances[i] = outwards > 0.0 ? -closest.distance_mm : closest.distance_mm;
  }
  return distances;
}

MeanStd mismatch(const VecX& signed_distances) {
  const VecX magnitudes = signed_distances.cwiseAbs();
  return mean_std({magnitudes.data(), static_cast<std::size_t>(magnitudes.size())});
}

}  // namespace brainshift::registration
