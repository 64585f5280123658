// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/measure.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "common/geometry/surface.hpp"

namespace brainshift::client {
namespace {

constexpr std::uint64_t kSeeds = std::uint64_t{1} << 53;
constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

// Points every `spacing` along the polyline that the segments make up, in the order they come in.
void walk_segments(const Points& segments, double spacing, std::vector<Vec3>& points) {
  double until_next = 0.0;
  for (Eigen::Index s = 0; s + 1 < segments.cols(); s += 2) {
    const Vec3 from = segments.col(s);
    const Vec3 along = segments.col(s + 1) - from;
    const double length = along.norm();
    double position = until_next;
    for (; position < length; position += spacing) {
      points.emplace_back(from + along * (position / length));
    }
    until_next = position - length;
  }
}

// Per component. (Not in braces: published surgeries have the components in the order of a call.)
Vec3 normal_vector(double sd, Random& random) {
  return Vec3(sd * random.normal(), sd * random.normal(), sd * random.normal());
}

// x -> R (x - centre) + centre + shift, R the turn by |turn| about it, radians.
void move(Points& points, const Vec3& turn, const Vec3& centre, const Vec3& shift) {
  const Mat3 rotation = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
  points = ((rotation * (points.colwise() - centre)).colwise() + Vec3(centre + shift)).eval();
}

}  // namespace

ProbeError::ProbeError(const ProbeErrors& errors) : errors_(errors), tracker_(errors.tracker_seed) {
  Random sides(errors.sweep_seed);
  for (bool& each : from_above_) each = sides.uniform() < 0.5;
  Random random(errors.calibration_seed);
  turn_ = normal_vector(errors.calibration_sd_deg * kRadiansPerDegree, random);
  shift_ = normal_vector(errors.calibration_sd_mm, random);
  scale_ = errors.scale_sd * random.normal();
}

bool ProbeError::sweeps(int sweep, double share) const {
  return (from_above_[sweep] ? 1.0 - share : share) <= errors_.swept_part;
}

void ProbeError::disturb(Points& section, const Vec3& centre, const Vec3& probe) {
  if (errors_.tracker_sd_mm > 0.0 || errors_.tracker_sd_deg > 0.0) {
    const Vec3 turn = normal_vector(errors_.tracker_sd_deg * kRadiansPerDegree, tracker_);
    move(section, turn, centre, normal_vector(errors_.tracker_sd_mm, tracker_));
  }
  if (scale_ != 0.0) section += scale_ * (section.colwise() - probe);
  if (!turn_.isZero(0.0) || !shift_.isZero(0.0)) move(section, turn_, centre, shift_);
}

void add_noise(Points& points, double sd_mm, Random& random) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double magnitude = sd_mm * random.normal();
    points.col(i) += magnitude * random.direction();
  }
}

LandmarkPairs measure_displacements(const Points& undeformed, const Points& displacement,
                                    double noise_sd_mm, Random& random) {
  LandmarkPairs pairs;
  pairs.undeformed = undeformed;
  pairs.deformed = undeformed + displacement;
  add_noise(pairs.deformed, noise_sd_mm, random);
  pairs.sd_mm = noise_sd_mm / std::sqrt(3.0);
  return pairs;
}

CorticalSurface measure_cortex(const TriangleSurface& deformed, const CortexView& view,
                               Random& random) {
  const auto count = static_cast<int>(std::lround(view.points_per_mm2 * geometry::area(deformed)));
  Points points = geometry::sample_surface(deformed, count, random.index(kSeeds));
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    points.data()[i] += view.noise_sd_mm * random.normal();
  }
  const Vec3 turn = normal_vector(view.pose_sd_deg * kRadiansPerDegree, random);
  const Vec3 shift = normal_vector(view.pose_sd_mm, random);
  move(points, turn, deformed.vertices.rowwise().mean(), shift);
  CorticalSurface surface;
  surface.surface.vertices = std::move(points);
  surface.sd_mm = view.noise_sd_mm;
  return surface;
}

std::array<Vec3, 2> sweep_normals(const Vec3& centroid, const Vec3& probe_position) {
  const Vec3 axis = (centroid - probe_position).normalized();
  int least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Vec3 first = axis.cross(Vec3::Unit(least)).normalized();
  return {first, axis.cross(first)};
}

TumourBoundary measure_probe_sections(const TriangleSurface& deformed_tumour,
                                      const Vec3& probe_position, const Scenario& scenario,
                                      ProbeError& error, Random& random) {
  const Vec3 centroid = deformed_tumour.vertices.rowwise().mean();
  const std::array<Vec3, 2> normals = sweep_normals(centroid, probe_position);
  std::vector<Vec3> points;
  std::vector<std::size_t> ends;  // of the sections in `points`
  for (int sweep = 0; sweep < 2; ++sweep) {
    const Vec3& normal = normals[static_cast<std::size_t>(sweep)];
    const VecX heights = deformed_tumour.vertices.transpose() * normal;
    const double low = heights.minCoeff(), high = heights.maxCoeff();
    for (double offset = low + 0.5 * scenario.section_spacing_mm; offset < high;
         offset += scenario.section_spacing_mm) {
      if (!error.sweeps(sweep, (offset - low) / (high - low))) continue;
      walk_segments(geometry::plane_section(deformed_tumour, normal, offset),
                    scenario.point_spacing_mm, points);
      ends.push_back(points.size());
    }
  }
  TumourBoundary boundary;
  boundary.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    boundary.points.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  add_noise(boundary.points, scenario.noise_sd_mm, random);
  Eigen::Index begin = 0;
  for (const std::size_t end : ends) {
    const Eigen::Index count = static_cast<Eigen::Index>(end) - begin;
    Points section = boundary.points.middleCols(begin, count);
    error.disturb(section, centroid, probe_position);
    boundary.points.middleCols(begin, count) = section;
    begin += count;
  }
  boundary.sd_mm = scenario.noise_sd_mm / std::sqrt(3.0);
  return boundary;
}

}  // namespace brainshift::client
