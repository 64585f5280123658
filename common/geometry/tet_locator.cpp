// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/tet_locator.hpp"

#include <Eigen/LU>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::geometry {
namespace {

// A weight that rounding has made this negative still counts as inside: neighbouring tetrahedra
// compute their common face differently, and no point may fall between them.
constexpr double kTolerance = 1e-10;

using Cell = Eigen::Array3i;
using Box = Eigen::AlignedBox3d;

}  // namespace

struct TetLocator::Impl {
  Points nodes;
  Eigen::Matrix<int, 4, Eigen::Dynamic> tets;
  std::vector<Mat3> inverse;  // (w1, w2, w3) = inverse * (x - x0)

  // Uniform grid; the tetrahedra whose box meets cell c are members[first[c] .. first[c + 1]).
  Box box;
  double cell_mm = 1.0;
  Cell dims = Cell::Ones();
  std::vector<int> first, members;

  std::vector<int> tet_of_boundary_triangle;
  std::optional<ClosestPointIndex> boundary;

  Cell cell_of(const Vec3& x) const {
    const Eigen::Array3d c = ((x - box.min()) / cell_mm).array().floor();
    return c.cwiseMax(0.0).cwiseMin((dims - 1).cast<double>()).cast<int>();
  }
  std::size_t index_of(const Cell& c) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return at(c[0]) + at(dims[0]) * (at(c[1]) + at(dims[1]) * at(c[2]));
  }
  template <typename Visit>
  void for_each_cell_of(int tet, const Visit& visit) const;
  void fill_grid();
  void find_boundary(const TetMesh& mesh);

  Eigen::Vector4d weights(int tet, const Vec3& x) const {
    const Vec3 w = inverse[static_cast<std::size_t>(tet)] * (x - nodes.col(tets(0, tet)));
    return {1.0 - w.sum(), w[0], w[1], w[2]};
  }
  TetLocation locate_inside(const Vec3& query) const;
  TetLocation locate_outside(const Vec3& query) const;
};

template <typename Visit>
void TetLocator::Impl::for_each_cell_of(int tet, const Visit& visit) const {
  Box extent;
  for (int k = 0; k < 4; ++k) extent.extend(nodes.col(tets(k, tet)));
  const Cell low = cell_of(extent.min());
  const Cell high = cell_of(extent.max());
  for (int z = low[2]; z <= high[2]; ++z)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) visit(index_of(Cell(x, y, z)));
}

void TetLocator::Impl::fill_grid() {
  const int num_tets = static_cast<int>(tets.cols());
  for (int k = 0; k < 4; ++k)
    for (int t = 0; t < num_tets; ++t) box.extend(nodes.col(tets(k, t)));
  // About the mean edge: the edge of regular tetrahedra that share the box among them, a little
  // more than the true one as the mesh does not fill its box. So there are fewer cells than
  // tetrahedra.
  const double share = box.volume() / num_tets;
  cell_mm = std::cbrt(6.0 * std::sqrt(2.0) * share);
  dims = (box.sizes() / cell_mm).array().ceil().cwiseMax(1.0).cast<int>();
  first.assign(static_cast<std::size_t>(dims.prod()) + 1, 0);
  for (int t = 0; t < num_tets; ++t) for_each_cell_of(t, [&](std::size_t c) { ++first[c + 1]; });
  for (std::size_t c = 1; c < first.size(); ++c) first[c] += first[c - 1];
  members.resize(static_cast<std::size_t>(first.back()));
  std::vector<int> next(first.begin(), first.end() - 1);
  for (int t = 0; t < num_tets; ++t)
    for_each_cell_of(t, [&](std::size_t c) { members[static_cast<std::size_t>(next[c]++)] = t; });
}

void TetLocator::Impl::find_boundary(const TetMesh& mesh) {
  TriangleSurface surface;
  surface.vertices = mesh.nodes;
  surface.triangles = boundary_triangles(mesh, &tet_of_boundary_triangle);
  auto index = ClosestPointIndex::build(surface);
  assert(index.has_value() && "precondition: check_mesh(mesh)");
  if (index) boundary.emplace(std::move(*index));
}

TetLocation TetLocator::Impl::locate_inside(const Vec3& query) const {
  TetLocation best;
  double least_weight = -kTolerance;
  const std::size_t cell = index_of(cell_of(query));
  for (int i = first[cell]; i < first[cell + 1]; ++i) {
    const int tet = members[static_cast<std::size_t>(i)];
    const Eigen::Vector4d w = weights(tet, query);
    if (!(w.minCoeff() >= least_weight)) continue;
    // The deepest one, so that a point on a common face has one answer.
    if (best.tet >= 0 && w.minCoeff() == least_weight) continue;
    least_weight = w.minCoeff();
    best.tet = tet;
    best.weights = w;
  }
  if (best.tet < 0) return best;
  best.nodes = tets.col(best.tet);
  best.weights = best.weights.cwiseMax(0.0);
  best.weights /= best.weights.sum();
  return best;
}

TetLocation TetLocator::Impl::locate_outside(const Vec3& query) const {
  const ClosestPoint closest = boundary->closest(query);
  TetLocation location;
  location.tet = tet_of_boundary_triangle[static_cast<std::size_t>(closest.triangle)];
  location.nodes = tets.col(location.tet);
  location.weights = weights(location.tet, closest.point).cwiseMax(0.0);
  location.weights /= location.weights.sum();
  location.distance_mm = (query - value_at(location, nodes)).norm();
  return location;
}

TetLocator::TetLocator(const TetMesh& mesh) : impl_(std::make_unique<Impl>()) {
  impl_->nodes = mesh.nodes;
  impl_->tets = mesh.tets;
  if (mesh.num_tets() == 0) return;
  impl_->inverse.reserve(static_cast<std::size_t>(mesh.num_tets()));
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Mat3 edges;
    for (int k = 0; k < 3; ++k)
      edges.col(k) = mesh.nodes.col(mesh.tets(k + 1, t)) - mesh.nodes.col(mesh.tets(0, t));
    impl_->inverse.emplace_back(edges.inverse());
  }
  impl_->fill_grid();
  impl_->find_boundary(mesh);
}

const Points& TetLocator::nodes() const { return impl_->nodes; }
const Eigen::Matrix<int, 4, Eigen::Dynamic>& TetLocator::tets() const { return impl_->tets; }

TetLocator::TetLocator(TetLocator&&) noexcept = default;
TetLocator& TetLocator::operator=(TetLocator&&) noexcept = default;
TetLocator::~TetLocator() = default;

TetLocation TetLocator::locate(const Vec3& query) const {
  TetLocation nowhere;
  nowhere.distance_mm = std::numeric_limits<double>::infinity();
  if (!impl_->boundary || !query.allFinite()) return nowhere;
  if (impl_->box.contains(query)) {
    TetLocation inside = impl_->locate_inside(query);
    if (inside.tet >= 0) return inside;
  }
  return impl_->locate_outside(query);
}

}  // namespace brainshift::geometry
