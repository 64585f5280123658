// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/surface_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "common/geometry/misplacement.hpp"

namespace brainshift::geometry {
namespace {

// A directed edge has the number 3 t + k: it goes from corner k to corner k + 1 of triangle t.
using EdgeOf = std::unordered_map<std::uint64_t, int>;

std::uint64_t key(int from, int to) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(from)) << 32) |
         static_cast<std::uint32_t>(to);
}

int corner(const TriangleSurface& surface, int edge) {
  return surface.triangles(edge % 3, edge / 3);
}
int next_in_triangle(int edge) { return edge % 3 == 2 ? edge - 2 : edge + 1; }

// The edge of another triangle that runs the other way; -1 on a rim.
int opposite(const TriangleSurface& surface, const EdgeOf& edges, int edge) {
  const auto found =
      edges.find(key(corner(surface, next_in_triangle(edge)), corner(surface, edge)));
  return found == edges.end() ? -1 : found->second;
}

Result<EdgeOf> directed_edges(const TriangleSurface& surface) {
  EdgeOf edges;
  std::unordered_map<std::uint64_t, int> uses;  // of the undirected edge
  for (int t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles(k, t), b = surface.triangles((k + 1) % 3, t);
      if (a < 0 || a >= surface.num_vertices() || a == b) {
        return fail(ErrorCode::kDegenerateMesh,
                    fmt::format("triangle {} has the vertices {} {} {}: must be three of {}", t,
                                surface.triangles(0, t), surface.triangles(1, t),
                                surface.triangles(2, t), surface.num_vertices()));
      }
      if (++uses[key(std::min(a, b), std::max(a, b))] > 2) {
        return fail(
            ErrorCode::kDegenerateMesh,
            fmt::format("the edge between vertices {} and {} has more than two triangles", a, b));
      }
    }
  }
  for (int t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles(k, t), b = surface.triangles((k + 1) % 3, t);
      const auto [entry, is_new] = edges.emplace(key(a, b), 3 * t + k);
      if (is_new) continue;
      return fail(
          ErrorCode::kDegenerateMesh,
          fmt::format("triangles {} and {} are turned against each other", entry->second / 3, t));
    }
  }
  return edges;
}

std::vector<int> part_of_triangles(const TriangleSurface& surface, const EdgeOf& edges,
                                   int& parts) {
  std::vector<int> part(static_cast<std::size_t>(surface.num_triangles()), -1);
  std::vector<int> open;
  parts = 0;
  for (int start = 0; start < surface.num_triangles(); ++start) {
    if (part[static_cast<std::size_t>(start)] >= 0) continue;
    part[static_cast<std::size_t>(start)] = parts;
    open.push_back(start);
    while (!open.empty()) {
      const int t = open.back();
      open.pop_back();
      for (int k = 0; k < 3; ++k) {
        const int other = opposite(surface, edges, 3 * t + k);
        if (other < 0 || part[static_cast<std::size_t>(other / 3)] >= 0) continue;
        part[static_cast<std::size_t>(other / 3)] = parts;
        open.push_back(other / 3);
      }
    }
    ++parts;
  }
  return part;
}

// From a rim edge to the next one: turn about its end, triangle by triangle, until there is no
// further one.
int next_on_rim(const TriangleSurface& surface, const EdgeOf& edges, int edge) {
  int candidate = next_in_triangle(edge);
  for (int other = opposite(surface, edges, candidate); other >= 0;
       other = opposite(surface, edges, candidate)) {
    candidate = next_in_triangle(other);
  }
  return candidate;
}

}  // namespace

Result<SurfaceRims> surface_rims(const TriangleSurface& surface) {
  const auto edges = directed_edges(surface);
  if (!edges) return tl::unexpected(edges.error());
  SurfaceRims rims;
  const std::vector<int> part = part_of_triangles(surface, *edges, rims.parts);
  const int count = 3 * surface.num_triangles();
  std::vector<bool> walked(static_cast<std::size_t>(count), false);
  for (int start = 0; start < count; ++start) {
    if (walked[static_cast<std::size_t>(start)] || opposite(surface, *edges, start) >= 0) continue;
    double length = 0.0;
    for (int edge = start; !walked[static_cast<std::size_t>(edge)];
         edge = next_on_rim(surface, *edges, edge)) {
      walked[static_cast<std::size_t>(edge)] = true;
      ++rims.open_edges;
      length += (surface.vertices.col(corner(surface, next_in_triangle(edge))) -
                 surface.vertices.col(corner(surface, edge)))
                    .norm();
    }
    rims.part_of_rim.push_back(part[static_cast<std::size_t>(start / 3)]);
    rims.rim_mm.push_back(length);
  }
  return rims;
}

namespace {

constexpr int kFewestPoints = 50;
// Extent over the craniotomy's size. A camera may see only a part of the craniotomy, or also drapes
// and skin around it.
constexpr double kMinExtent = 0.2, kMaxExtent = 6.0;
// The brain sinks by up to 20 mm (Roberts et al. 1998). A surface farther away has a wrong pose.
constexpr double kFarthest_mm = 25.0;
constexpr double kMinCosine = 0.3;

Vec3 face_area_vector(const Points& vertices, const Eigen::Vector3i& t) {
  const Vec3 a = vertices.col(t[0]);
  return (vertices.col(t[1]) - a).cross(vertices.col(t[2]) - a);
}

Status check_points(const Points& points) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (points.col(i).allFinite()) continue;
    return fail(ErrorCode::kNotFinite, fmt::format("surface point {} is not finite", i));
  }
  if (points.cols() >= kFewestPoints) return {};
  return fail(ErrorCode::kEmptySet, fmt::format("the surface has {} points: must be at least {}",
                                                points.cols(), kFewestPoints));
}

Status check_extent(double extent_mm, const CorticalSite& site) {
  const double least = kMinExtent * site.size_mm;
  const double most = kMaxExtent * site.size_mm;
  if (extent_mm >= least && extent_mm <= most) return {};
  const auto fits = [&](double factor) {
    return factor * extent_mm >= least && factor * extent_mm <= most;
  };
  std::string unit;
  if (fits(1000.0)) {
    unit = "; metres?";
  } else if (fits(10.0)) {
    unit = "; centimetres?";
  } else if (fits(0.001)) {
    unit = "; micrometres?";
  }
  return invalid(fmt::format(
      "the surface spans {:.3g} mm: must be {:.3g} to {:.3g} mm for a craniotomy of {:.3g} mm{}",
      extent_mm, least, most, site.size_mm, unit));
}

// Turns the triangles outwards, and notes it in `checked`.
Status orient(CheckedSurface& checked, const CorticalSite& site) {
  TriangleSurface& surface = checked.surface;
  double along = 0.0, area = 0.0;
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const Vec3 n = face_area_vector(surface.vertices, surface.triangles.col(t));
    along += n.dot(site.outward);
    area += n.norm();
  }
  const double cosine = area > 0.0 ? along / area : 0.0;
  if (std::abs(cosine) < kMinCosine) {
    return invalid(
        fmt::format("the surface's normals look neither out of the craniotomy nor into it: mean "
                    "cosine {:.2f}, must be at least {:g} either way",
                    cosine, kMinCosine));
  }
  if (cosine > 0.0) return {};
  surface.triangles.row(1).swap(surface.triangles.row(2));
  checked.turned = true;
  checked.notes.emplace_back("the triangles looked into the head and were turned round");
  return {};
}

void count_holes(CheckedSurface& checked, const SurfaceRims& rims) {
  checked.parts = rims.parts;
  std::vector<double> outer(static_cast<std::size_t>(rims.parts), 0.0);
  std::vector<int> outer_rim(static_cast<std::size_t>(rims.parts), -1);
  for (std::size_t i = 0; i < rims.rim_mm.size(); ++i) {
    const auto part = static_cast<std::size_t>(rims.part_of_rim[i]);
    if (rims.rim_mm[i] <= outer[part]) continue;
    outer[part] = rims.rim_mm[i];
    outer_rim[part] = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < rims.rim_mm.size(); ++i) {
    if (outer_rim[static_cast<std::size_t>(rims.part_of_rim[i])] == static_cast<int>(i)) continue;
    ++checked.holes;
    checked.longest_hole_rim_mm = std::max(checked.longest_hole_rim_mm, rims.rim_mm[i]);
  }
  if (checked.parts > 1)
    checked.notes.push_back(fmt::format("the surface has {} separate parts", checked.parts));
  if (checked.holes > 0)
    checked.notes.push_back(fmt::format("the surface has {} holes, the longest rim {:.1f} mm",
                                        checked.holes, checked.longest_hole_rim_mm));
}

}  // namespace

Result<CorticalSite> craniotomy_site(const BrainModel& model) {
  const std::vector<NodeIndex>& nodes = model.craniotomy;
  std::vector<bool> open(static_cast<std::size_t>(model.mesh.num_nodes()), false);
  CorticalSite site;
  site.size_mm = 0.0;
  for (const NodeIndex a : nodes) {
    open[static_cast<std::size_t>(a)] = true;
    site.centre += model.mesh.nodes.col(a) / static_cast<double>(nodes.size());
    for (const NodeIndex b : nodes)
      site.size_mm =
          std::max(site.size_mm, (model.mesh.nodes.col(a) - model.mesh.nodes.col(b)).norm());
  }
  Vec3 normal = Vec3::Zero();
  for (Eigen::Index t = 0; t < model.boundary_triangles.cols(); ++t) {
    const Eigen::Vector3i corners = model.boundary_triangles.col(t);
    const bool inside = std::all_of(corners.begin(), corners.end(), [&](int node) {
      return static_cast<bool>(open[static_cast<std::size_t>(node)]);
    });
    if (inside) normal += face_area_vector(model.mesh.nodes, corners);
  }
  if (!(normal.norm() > 0.0)) {
    return fail(ErrorCode::kEmptySet,
                "the model's craniotomy has no boundary triangle: nowhere to see the cortex");
  }
  site.outward = normal.normalized();
  return site;
}

Result<CheckedSurface> check_cortical_surface(TriangleSurface surface, const CorticalSite& site) {
  if (Status ok = check_points(surface.vertices); !ok) return tl::unexpected(ok.error());
  CheckedSurface checked;
  checked.surface = std::move(surface);
  const Points& points = checked.surface.vertices;
  checked.extent_mm = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  if (Status ok = check_extent(checked.extent_mm, site); !ok) return tl::unexpected(ok.error());
  checked.distance_mm = (points.colwise() - site.centre).colwise().norm().minCoeff();
  if (checked.distance_mm > kFarthest_mm) {
    const std::string mistake = likely_mistake(points, [&](const Points& meant) {
      const double extent = (meant.rowwise().maxCoeff() - meant.rowwise().minCoeff()).norm();
      return check_extent(extent, site) &&
             (meant.colwise() - site.centre).colwise().norm().minCoeff() <= kFarthest_mm;
    });
    return invalid(fmt::format(
        "the surface's closest point is {:.1f} mm from the craniotomy's centre: must "
        "be within {:g} mm{}",
        checked.distance_mm, kFarthest_mm, mistake.empty() ? "; is its pose right?" : mistake));
  }
  if (checked.surface.num_triangles() == 0) return checked;
  const auto rims = surface_rims(checked.surface);
  if (!rims) return tl::unexpected(rims.error());
  count_holes(checked, *rims);
  if (Status ok = orient(checked, site); !ok) return tl::unexpected(ok.error());
  return checked;
}

}  // namespace brainshift::geometry
