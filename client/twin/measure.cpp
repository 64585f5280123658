// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/measure.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/geometry/surface.hpp"

namespace brainshift::client {
namespace {

constexpr std::uint64_t kSeeds = std::uint64_t{1} << 53;

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

}  // namespace

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
  const auto draw = [&](double sd) {
    return Vec3(sd * random.normal(), sd * random.normal(), sd * random.normal());
  };
  const Vec3 turn = draw(view.pose_sd_deg * std::numbers::pi / 180.0);
  const Vec3 shift = draw(view.pose_sd_mm);
  const Vec3 centre = deformed.vertices.rowwise().mean();
  const Mat3 rotation = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
  CorticalSurface surface;
  surface.surface.vertices =
      (rotation * (points.colwise() - centre)).colwise() + Vec3(centre + shift);
  surface.sd_mm = view.noise_sd_mm;
  return surface;
}

TumourBoundary measure_probe_sections(const TriangleSurface& deformed_tumour,
                                      const Vec3& probe_position, const Scenario& scenario,
                                      Random& random) {
  const Vec3 centroid = deformed_tumour.vertices.rowwise().mean();
  const Vec3 axis = (centroid - probe_position).normalized();
  int least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Vec3 first = axis.cross(Vec3::Unit(least)).normalized();
  const Vec3 second = axis.cross(first);

  std::vector<Vec3> points;
  for (const Vec3& normal : {first, second}) {
    const VecX heights = deformed_tumour.vertices.transpose() * normal;
    const double low = heights.minCoeff();
    for (double offset = low + 0.5 * scenario.section_spacing_mm; offset < heights.maxCoeff();
         offset += scenario.section_spacing_mm) {
      walk_segments(geometry::plane_section(deformed_tumour, normal, offset),
                    scenario.point_spacing_mm, points);
    }
  }
  TumourBoundary boundary;
  boundary.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    boundary.points.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  add_noise(boundary.points, scenario.noise_sd_mm, random);
  boundary.sd_mm = scenario.noise_sd_mm / std::sqrt(3.0);
  return boundary;
}

}  // namespace brainshift::client
