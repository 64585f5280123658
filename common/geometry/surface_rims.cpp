// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/surface_rims.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <numeric>
#include <unordered_map>

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
      length += (surface.vertices.col(corner(surface, next_in_triangle(edge))) -
                 surface.vertices.col(corner(surface, edge)))
                    .norm();
    }
    rims.part_of_rim.push_back(part[static_cast<std::size_t>(start / 3)]);
    rims.rim_mm.push_back(length);
  }
  return rims;
}

}  // namespace brainshift::geometry
