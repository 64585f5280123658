// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numbers>
#include <utility>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"

namespace brainshift::registration {
namespace {

// Any fixed number; it makes a replay repeatable.
constexpr std::uint64_t kSubsetSeed = 20090627;
// A barycentric coordinate below this lies on the opposite edge.
constexpr double kOnEdge = 1e-9;

Vec3 barycentric(const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const double area = n.squaredNorm();
  const double wb = (q - a).cross(c - a).dot(n) / area;
  const double wc = (b - a).cross(q - a).dot(n) / area;
  return Vec3(1.0 - wb - wc, wb, wc);
}

// Errors of all points together when the camera's pose is wrong: three shifts, and three turns
// about the centre.
Eigen::MatrixXd pose_errors(const Points& places, const SurfaceDistanceOptions& options) {
  const bool shifts = options.pose_sd_mm > 0.0, turns = options.pose_sd_deg > 0.0;
  const Eigen::Index columns = (shifts ? 3 : 0) + (turns ? 3 : 0);
  if (columns == 0 || places.cols() == 0) return {};
  const Vec3 centre = places.rowwise().mean();
  const double turn_sd = options.pose_sd_deg * std::numbers::pi / 180.0;
  Eigen::MatrixXd errors(3 * places.cols(), columns);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 unit = Vec3::Unit(axis);
      if (shifts) errors.block<3, 1>(3 * i, axis) = options.pose_sd_mm * unit;
      if (turns) {
        errors.block<3, 1>(3 * i, columns - 3 + axis) =
            turn_sd * unit.cross(places.col(i) - centre);
      }
    }
  }
  return errors;
}

}  // namespace

SurfacePatch craniotomy_patch(const BrainModel& model) {
  SurfacePatch patch;
  patch.nodes = model.craniotomy;
  std::sort(patch.nodes.begin(), patch.nodes.end());
  std::map<NodeIndex, int> vertex;
  for (std::size_t i = 0; i < patch.nodes.size(); ++i) {
    vertex[patch.nodes[i]] = static_cast<int>(i);
  }
  patch.surface.vertices = model.mesh.nodes(Eigen::all, patch.nodes);
  std::vector<int> corners;
  for (Eigen::Index t = 0; t < model.boundary_triangles.cols(); ++t) {
    const auto triangle = model.boundary_triangles.col(t);
    if (!vertex.count(triangle[0]) || !vertex.count(triangle[1]) || !vertex.count(triangle[2])) {
      continue;
    }
    for (int k = 0; k < 3; ++k) corners.push_back(vertex[triangle[k]]);
  }
  patch.surface.triangles = Eigen::Map<const Eigen::Matrix<int, 3, Eigen::Dynamic>>(
      corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  return patch;
}

SurfaceDistances::SurfaceDistances(SurfacePatch patch, const SurfaceDistanceOptions& options)
    : patch_(std::move(patch)), options_(options) {
  std::map<std::pair<int, int>, int> uses;
  const auto& triangles = patch_.surface.triangles;
  const auto edge = [&](int t, int k) {
    return std::minmax(triangles(k, t), triangles((k + 1) % 3, t));
  };
  for (int t = 0; t < triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) ++uses[edge(t, k)];
  }
  for (int t = 0; t < triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) rim_edge_.push_back(uses[edge(t, k)] == 1 ? 1 : 0);
  }
}

Result<SurfaceDistances> SurfaceDistances::build(SurfacePatch patch, const Points& measured,
                                                 const SurfaceDistanceOptions& options) {
  if (patch.surface.num_triangles() == 0) {
    return fail(ErrorCode::kEmptySet,
                "cortical surface: the craniotomy of the model has no triangle to compare it with");
  }
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    if (!measured.col(i).allFinite()) {
      return fail(ErrorCode::kNotFinite,
                  fmt::format("cortical surface: point {} is not finite", i));
    }
  }
  SurfaceDistances made(std::move(patch), options);
  std::vector<int> over;
  made.measure(Points::Zero(3, made.patch_.surface.num_vertices()), measured, &over);
  if (static_cast<int>(over.size()) < kFewestPoints) {
    const Vec3 centre = made.patch_.surface.vertices.rowwise().mean();
    const double away = measured.cols() > 0 ? (measured.rowwise().mean() - centre).norm() : 0.0;
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("cortical surface: {} of {} points lie over the craniotomy within {} mm, "
                    "at least {} are needed; their mean lies {:.1f} mm from its centre",
                    over.size(), measured.cols(), options.farthest_mm, kFewestPoints, away));
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

SparseData SurfaceDistances::measure(const Points& u, const Points& measured,
                                     std::vector<int>* kept) const {
  const TriangleSurface deformed{patch_.surface.vertices + u, patch_.surface.triangles};
  SparseData data;
  const auto index = geometry::ClosestPointIndex::build(deformed);
  if (!index) return data;  // folded to nothing: no datum
  data.positions.resize(3, measured.cols());
  data.displacements.resize(3, measured.cols());
  data.directions.resize(3, measured.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    const Vec3 p = measured.col(i);
    const geometry::ClosestPoint closest = index->closest(p);
    if (!(closest.distance_mm <= options_.farthest_mm)) continue;
    const auto corners = patch_.surface.triangles.col(closest.triangle);
    const Vec3 w =
        barycentric(closest.point, deformed.vertices.col(corners[0]),
                    deformed.vertices.col(corners[1]), deformed.vertices.col(corners[2]));
    bool on_rim = false;  // edge k lies opposite to corner k + 2
    for (int k = 0; k < 3; ++k) {
      on_rim = on_rim || (rim_edge_[static_cast<std::size_t>(3 * closest.triangle + k)] != 0 &&
                          w[(k + 2) % 3] < kOnEdge);
    }
    if (on_rim) continue;
    const Vec3 n = index->pseudo_normal(closest);
    const Vec3 x = w[0] * patch_.surface.vertices.col(corners[0]) +
                   w[1] * patch_.surface.vertices.col(corners[1]) +
                   w[2] * patch_.surface.vertices.col(corners[2]);
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
  data.common_error = pose_errors(data.positions, options_);
  return data;
}

SparseData SurfaceDistances::at(const Points& u) const { return measure(u, guiding_, nullptr); }

bool SurfaceDistances::moved(const SparseData& before, const SparseData& now) const {
  if (before.size() != now.size()) return true;
  return now.size() > 0 &&
         (now.positions - before.positions).colwise().norm().maxCoeff() > options_.settled_mm;
}

}  // namespace brainshift::registration
