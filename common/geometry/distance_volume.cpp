// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/distance_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::geometry {
namespace {

// Closer to the continued surface than this (mm), the direction away from it is rounding.
constexpr double kTouching = 1e-9;

}  // namespace

DistanceVolume::DistanceVolume(DistanceGrid grid)
    : grid_(std::move(grid)),
      last_cell_(grid_.dims[0] - 1, grid_.dims[1] - 1, grid_.dims[2] - 1),
      per_mm_(1.0 / grid_.spacing_mm) {}

Result<DistanceVolume> DistanceVolume::create(DistanceGrid grid) {
  if (grid.empty()) return fail(ErrorCode::kEmptySet, "distance grid: no values");
  if (Status valid = validate(grid); !valid) return tl::unexpected(valid.error());
  return DistanceVolume(std::move(grid));
}

// cells: position in units of the spacing, from the first node; within the grid.
DistanceSample DistanceVolume::inside(const Vec3& cells) const {
  const auto [n0, n1, n2] = grid_.dims;
  const int i = std::min(static_cast<int>(cells[0]), n0 - 2);
  const int j = std::min(static_cast<int>(cells[1]), n1 - 2);
  const int k = std::min(static_cast<int>(cells[2]), n2 - 2);
  const double u = cells[0] - i, v = cells[1] - j, w = cells[2] - k;
  const float* p = grid_.values.data() + grid_.index(i, j, k);
  const float* q = p + static_cast<std::size_t>(n0) * static_cast<std::size_t>(n1);
  // Along x first: value and difference on the cell's four edges in that direction.
  const double a0 = p[0], b0 = p[n0], c0 = q[0], d0 = q[n0];
  const double a1 = p[1] - a0, b1 = p[n0 + 1] - b0, c1 = q[1] - c0, d1 = q[n0 + 1] - d0;
  const double a = a0 + u * a1, b = b0 + u * b1, c = c0 + u * c1, d = d0 + u * d1;
  const double low = a + v * (b - a), high = c + v * (d - c);
  const double low_x = a1 + v * (b1 - a1), high_x = c1 + v * (d1 - c1);
  DistanceSample sample;
  sample.distance_mm = low + w * (high - low);
  sample.gradient =
      per_mm_ * Vec3(low_x + w * (high_x - low_x), (b - a) + w * ((d - c) - (b - a)), high - low);
  return sample;
}

DistanceSample DistanceVolume::outside(const Vec3& x, const Vec3& cells) const {
  const Vec3 nearest = cells.cwiseMax(0.0).cwiseMin(last_cell_);
  DistanceSample rim = inside(nearest);
  const double slope = rim.gradient.norm();
  if (!(slope > kTouching)) return rim;
  const Vec3 c = grid_.origin_mm + grid_.spacing_mm * nearest;
  const Vec3 away = x - (c - rim.distance_mm * rim.gradient / slope);
  DistanceSample sample;
  const double size = away.norm();
  // Beyond a grid that ends inside the surface the sign is that of the grid's rim.
  const double sign = rim.distance_mm < 0.0 ? -1.0 : 1.0;
  sample.distance_mm = sign * size;
  sample.gradient = size > kTouching ? Vec3(sign * away / size) : Vec3(rim.gradient / slope);
  return sample;
}

DistanceSample DistanceVolume::at(const Vec3& x) const {
  const Vec3 cells = per_mm_ * (x - grid_.origin_mm);
  const bool within = (cells.array() >= 0.0).all() && (cells.array() <= last_cell_.array()).all();
  return within ? inside(cells) : outside(x, cells);
}

void DistanceVolume::at(const PointRows& points, VecX& distances_mm, PointRows& gradients) const {
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const DistanceSample sample = at(Vec3(points.row(i)));
    distances_mm[i] = sample.distance_mm;
    gradients.row(i) = sample.gradient;
  }
}

namespace {

// Nodes nearer than this many spacings are measured against every triangle that near.
constexpr double kBandSpacings = 3.0;

// Triangles that share a corner with each triangle, ascending. Row t is
// ids[first[t] .. first[t + 1]).
struct Neighbours {
  std::vector<int> first, ids;
};

Neighbours neighbours_of(const TriangleSurface& surface) {
  std::vector<std::vector<int>> at_vertex(static_cast<std::size_t>(surface.num_vertices()));
  for (int t = 0; t < surface.num_triangles(); ++t)
    for (int k = 0; k < 3; ++k)
      at_vertex[static_cast<std::size_t>(surface.triangles(k, t))].push_back(t);
  Neighbours result;
  result.first.push_back(0);
  std::vector<int> around;
  for (int t = 0; t < surface.num_triangles(); ++t) {
    around.clear();
    for (int k = 0; k < 3; ++k) {
      const auto& more = at_vertex[static_cast<std::size_t>(surface.triangles(k, t))];
      around.insert(around.end(), more.begin(), more.end());
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    std::erase(around, t);
    result.ids.insert(result.ids.end(), around.begin(), around.end());
    result.first.push_back(static_cast<int>(result.ids.size()));
  }
  return result;
}

class GridBuilder {
 public:
  GridBuilder(const ClosestPointIndex& index, DistanceGrid grid, int threads);
  DistanceGrid build();

 private:
  struct Node {
    double squared_mm2 = std::numeric_limits<double>::infinity();
    int triangle = -1;
    bool inside = false;
  };

  bool has_area(int t) const { return area_[static_cast<std::size_t>(t)] != 0; }
  double squared_distance(int t, const Vec3& x) const {
    return (x - closest_on_triangle(frames_[static_cast<std::size_t>(t)], x)).squaredNorm();
  }
  void measure_band(int first_layer, int end_layer);
  void measure_box(int triangle, int first_layer, int end_layer);
  void find_sign(Node& node, const Vec3& x) const;
  void sweep(int sign_i, int sign_j, int sign_k);
  void take_over(Node& node, const Node& from, const Vec3& x) const;
  void walk(int first_layer, int end_layer);
  template <typename Body>
  void for_nodes(int first_layer, int end_layer, Body&& body);

  const ClosestPointIndex& index_;
  DistanceGrid grid_;
  ThreadTeam team_;
  std::vector<TriangleFrame> frames_;
  std::vector<char> area_;
  Neighbours neighbours_;
  std::vector<Node> nodes_;
  double band_mm_;
};

GridBuilder::GridBuilder(const ClosestPointIndex& index, DistanceGrid grid, int threads)
    : index_(index),
      grid_(std::move(grid)),
      team_(threads),
      neighbours_(neighbours_of(index.surface())),
      nodes_(grid_.num_nodes()) {
  band_mm_ = kBandSpacings * grid_.spacing_mm;
  const TriangleSurface& surface = index.surface();
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const auto corner = [&](int k) { return Vec3(surface.vertices.col(surface.triangles(k, t))); };
    frames_.emplace_back(corner(0), corner(1), corner(2));
    area_.push_back(index.triangle_normal(t).squaredNorm() > 0.5 ? 1 : 0);
  }
}

template <typename Body>
void GridBuilder::for_nodes(int first_layer, int end_layer, Body&& body) {
  for (int k = first_layer; k < end_layer; ++k)
    for (int j = 0; j < grid_.dims[1]; ++j)
      for (int i = 0; i < grid_.dims[0]; ++i)
        body(nodes_[grid_.index(i, j, k)], grid_.node(i, j, k));
}

// Nodes of the layers within the band of one triangle. Triangles come in ascending order and only
// a smaller distance replaces another, so the result does not depend on how layers are shared
// out.
void GridBuilder::measure_box(int triangle, int first_layer, int end_layer) {
  const TriangleFrame& frame = frames_[static_cast<std::size_t>(triangle)];
  const Vec3 b = frame.a + frame.ab, c = frame.a + frame.ac;
  const Vec3 low = frame.a.cwiseMin(b).cwiseMin(c).array() - band_mm_;
  const Vec3 high = frame.a.cwiseMax(b).cwiseMax(c).array() + band_mm_;
  int begin[3], end[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double h = grid_.spacing_mm;
    begin[axis] = std::max(0, static_cast<int>(std::ceil((low[axis] - grid_.origin_mm[axis]) / h)));
    end[axis] =
        std::min(grid_.dims[static_cast<std::size_t>(axis)],
                 static_cast<int>(std::floor((high[axis] - grid_.origin_mm[axis]) / h)) + 1);
  }
  for (int k = std::max(begin[2], first_layer); k < std::min(end[2], end_layer); ++k)
    for (int j = begin[1]; j < end[1]; ++j)
      for (int i = begin[0]; i < end[0]; ++i) {
        Node& node = nodes_[grid_.index(i, j, k)];
        const double squared = squared_distance(triangle, grid_.node(i, j, k));
        if (squared > band_mm_ * band_mm_ || squared >= node.squared_mm2) continue;
        node.squared_mm2 = squared;
        node.triangle = triangle;
      }
}

void GridBuilder::find_sign(Node& node, const Vec3& x) const {
  ClosestPoint closest;
  closest.triangle = node.triangle;
  closest.point = closest_on_triangle(frames_[static_cast<std::size_t>(node.triangle)], x);
  node.inside = index_.pseudo_normal(closest).dot(x - closest.point) < 0.0;
}

void GridBuilder::measure_band(int first_layer, int end_layer) {
  for (int t = 0; t < index_.surface().num_triangles(); ++t)
    if (has_area(t)) measure_box(t, first_layer, end_layer);
  for_nodes(first_layer, end_layer, [&](Node& node, const Vec3& x) {
    if (node.triangle >= 0) find_sign(node, x);
  });
}

// A node without a triangle is farther than the band, so the surface does not pass between it and
// a neighbour: they are on the same side.
void GridBuilder::take_over(Node& node, const Node& from, const Vec3& x) const {
  if (from.triangle < 0 || from.triangle == node.triangle) return;
  const double squared = squared_distance(from.triangle, x);
  if (node.triangle < 0) node.inside = from.inside;
  if (squared >= node.squared_mm2) return;
  node.squared_mm2 = squared;
  node.triangle = from.triangle;
}

// One pass over the grid in the given direction along each axis, with the neighbours behind.
void GridBuilder::sweep(int sign_i, int sign_j, int sign_k) {
  const auto [n0, n1, n2] = grid_.dims;
  const auto start = [](int sign, int n) { return sign > 0 ? 0 : n - 1; };
  const double band = band_mm_ * band_mm_;
  for (int c = 0, k = start(sign_k, n2); c < n2; ++c, k += sign_k)
    for (int b = 0, j = start(sign_j, n1); b < n1; ++b, j += sign_j)
      for (int a = 0, i = start(sign_i, n0); a < n0; ++a, i += sign_i) {
        Node& node = nodes_[grid_.index(i, j, k)];
        if (node.squared_mm2 <= band) continue;
        const Vec3 x = grid_.node(i, j, k);
        if (a > 0) take_over(node, nodes_[grid_.index(i - sign_i, j, k)], x);
        if (b > 0) take_over(node, nodes_[grid_.index(i, j - sign_j, k)], x);
        if (c > 0) take_over(node, nodes_[grid_.index(i, j, k - sign_k)], x);
      }
}

// From triangle to adjacent triangle while that brings a far node closer to the surface.
void GridBuilder::walk(int first_layer, int end_layer) {
  const double band = band_mm_ * band_mm_;
  for_nodes(first_layer, end_layer, [&](Node& node, const Vec3& x) {
    if (node.squared_mm2 <= band) return;
    for (int from = -1; from != node.triangle;) {
      from = node.triangle;
      const int begin = neighbours_.first[static_cast<std::size_t>(from)];
      const int end = neighbours_.first[static_cast<std::size_t>(from) + 1];
      for (int k = begin; k < end; ++k) {
        const int t = neighbours_.ids[static_cast<std::size_t>(k)];
        if (!has_area(t)) continue;
        const double squared = squared_distance(t, x);
        if (squared >= node.squared_mm2) continue;
        node.squared_mm2 = squared;
        node.triangle = t;
      }
    }
  });
}

DistanceGrid GridBuilder::build() {
  team_.split(grid_.dims[2], [&](long begin, long end) {
    measure_band(static_cast<int>(begin), static_cast<int>(end));
  });
  for (const int sign_k : {1, -1})
    for (const int sign_j : {1, -1})
      for (const int sign_i : {1, -1}) sweep(sign_i, sign_j, sign_k);
  team_.split(grid_.dims[2],
              [&](long begin, long end) { walk(static_cast<int>(begin), static_cast<int>(end)); });
  grid_.values.reserve(nodes_.size());
  for (const Node& node : nodes_) {
    const auto distance = static_cast<float>(std::sqrt(node.squared_mm2));
    grid_.values.push_back(node.inside ? -distance : distance);
  }
  return std::move(grid_);
}

// Nodes over the surface's box and margin. No node has a distance yet.
DistanceGrid empty_grid(const TriangleSurface& surface, const DistanceGridOptions& options) {
  const Vec3 low = surface.vertices.rowwise().minCoeff().array() - options.margin_mm;
  const Vec3 high = surface.vertices.rowwise().maxCoeff().array() + options.margin_mm;
  DistanceGrid grid;
  grid.origin_mm = low;
  grid.spacing_mm = options.spacing_mm;
  const auto count_nodes = [&] {
    const Vec3 cells = ((high - low) / grid.spacing_mm).array().ceil().max(1.0);
    return Vec3(cells.array() + 1.0);
  };
  Vec3 nodes = count_nodes();
  while (nodes.prod() > options.max_nodes) {
    grid.spacing_mm *= std::max(1.01, std::cbrt(nodes.prod() / options.max_nodes));
    nodes = count_nodes();
    if ((nodes.array() <= 2.0).all()) break;
  }
  for (int axis = 0; axis < 3; ++axis)
    grid.dims[static_cast<std::size_t>(axis)] = static_cast<int>(nodes[axis]);
  return grid;
}

}  // namespace

Result<DistanceGrid> signed_distance_grid(const ClosestPointIndex& surface,
                                          const DistanceGridOptions& options) {
  if (!(std::isfinite(options.spacing_mm) && options.spacing_mm > 0.0))
    return invalid(fmt::format("distance grid: spacing_mm = {}: must be > 0", options.spacing_mm));
  if (!(std::isfinite(options.margin_mm) && options.margin_mm >= 0.0))
    return invalid(fmt::format("distance grid: margin_mm = {}: must be >= 0", options.margin_mm));
  if (!(options.max_nodes >= 8.0 && options.max_nodes <= 1e9))
    return invalid(
        fmt::format("distance grid: max_nodes = {}: must be in [8, 1e9]", options.max_nodes));
  if (!is_closed(surface.surface()))
    return invalid(fmt::format("distance grid: the surface of {} triangles is not closed",
                               surface.surface().num_triangles()));
  DistanceGrid grid = empty_grid(surface.surface(), options);
  return GridBuilder(surface, std::move(grid), options.threads).build();
}

}  // namespace brainshift::geometry
