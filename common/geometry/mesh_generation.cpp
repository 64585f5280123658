// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mesh_generation.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Random.h>
#include <CGAL/assertions_behaviour.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/geometry/mask.hpp"
#include "common/geometry/mesh_quality.hpp"

namespace brainshift::geometry {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

constexpr double kFacetAngle_deg = 25.0;         // CGAL's guarantee needs at most 30
constexpr double kFacetDistanceOverEdge = 0.15;  // surface approximation error over edge
constexpr double kLooseDistanceOverEdge = 0.67;
constexpr double kCellRadiusEdgeRatio = 2.2;  // CGAL's guarantee needs more than 2

// CGAL bounds circumradii from above; users give edge lengths. With these ratios of bound to
// target the mean edge of the mesh is the target within a few per cent (measured on balls and on
// the head).
constexpr double kCellRadiusOverEdge = 0.74;
constexpr double kFacetRadiusOverEdge = 0.74;
// Bisection on the implicit function stops at this fraction of the bounding box: about 2 um on a
// head.
constexpr double kSurfaceTolerance = 1e-5;
constexpr unsigned kSeed = 20090529;

struct Division {
  const RegionField& region;
  const std::function<bool(int, int)>& loose;
};

// The sizing field as CGAL asks for it, times a factor.
struct ScaledField {
  using FT = Kernel::FT;
  using Point_3 = Triangulation::Bare_point;
  using Index = Domain::Index;

  const SizingField* edge_mm;
  double factor;
  const Division* division = nullptr;  // with it `factor` does not hold on loose interfaces

  FT operator()(const Point_3& p, int dimension, const Index& index) const {
    const double edge = (*edge_mm)(Vec3(p.x(), p.y(), p.z()));
    assert(std::isfinite(edge) && edge > 0.0);
    if (division != nullptr && dimension == 2) {
      const auto [a, b] = boost::get<Domain::Surface_patch_index>(index);
      if (a > 0 && b > 0 && division->loose(a, b)) return kLooseDistanceOverEdge * edge;
    }
    return factor * edge;
  }
};

// A cube round a point deep inside the domain that encloses all of the domain.
struct Enclosure {
  Vec3 centre = Vec3::Zero();
  double half_width = 0.0;

  CGAL::Bbox_3 bbox() const {
    return {centre.x() - half_width, centre.y() - half_width, centre.z() - half_width,
            centre.x() + half_width, centre.y() + half_width, centre.z() + half_width};
  }
};

// CGAL shoots its first rays from the centre of the enclosure and waits for hits, so the centre
// must lie inside: the voxel with the largest value, of equals the one nearest to the centroid.
std::optional<Enclosure> enclose(const VoxelImage& mask, float level) {
  Vec3 centroid = Vec3::Zero();
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  float largest = level;
  std::vector<std::size_t> deepest;
  std::size_t count = 0;
  const auto width = static_cast<std::size_t>(mask.dims[0]);
  const auto height = static_cast<std::size_t>(mask.dims[1]);
  const auto position = [&](std::size_t v) {
    return Vec3(static_cast<double>(v % width), static_cast<double>(v / width % height),
                static_cast<double>(v / (width * height)));
  };
  for (std::size_t v = 0; v < mask.values.size(); ++v) {
    if (!(mask.values[v] > level)) continue;
    const Vec3 x = position(v);
    low = count == 0 ? x : low.cwiseMin(x).eval();
    high = count == 0 ? x : high.cwiseMax(x).eval();
    centroid += x;
    ++count;
    if (mask.values[v] > largest) {
      largest = mask.values[v];
      deepest.clear();
    }
    if (mask.values[v] == largest) deepest.push_back(v);
  }
  if (count == 0) return std::nullopt;
  centroid /= static_cast<double>(count);
  const auto nearest =
      *std::min_element(deepest.begin(), deepest.end(), [&](std::size_t a, std::size_t b) {
        return (position(a) - centroid).squaredNorm() < (position(b) - centroid).squaredNorm();
      });
  Enclosure result{mask.T_ras_voxel * position(nearest), 0.0};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 x((corner & 1) ? high.x() + 1.5 : low.x() - 1.5,
                 (corner & 2) ? high.y() + 1.5 : low.y() - 1.5,
                 (corner & 4) ? high.z() + 1.5 : low.z() - 1.5);
    const Vec3 offset = mask.T_ras_voxel * x - result.centre;
    result.half_width = std::max(result.half_width, offset.cwiseAbs().maxCoeff());
  }
  return result;
}

// What goes wrong is a status here; CGAL would print it too.
void silence_cgal() {
  const auto nothing = [](const char*, const char*, const char*, int, const char*) {};
  static const bool once = [&] {
    CGAL::set_warning_handler(nothing);
    CGAL::set_error_handler(nothing);
    return true;
  }();
  static_cast<void>(once);
}

// division: null for a domain of one region.
Complex refine(const VoxelImage& smooth_mask, const Enclosure& enclosure, const Division* division,
               const SizingField& edge_mm, const MeshingOptions& options,
               const Progress& progress) {
  namespace p = CGAL::parameters;
  silence_cgal();
  const auto begin = p::mesh_3_options(p::number_of_initial_points = options.first_points);
  const Interpolator mask(smooth_mask);
  const double level = options.level;
  const auto outside_positive = [&mask, level](const Kernel::Point_3& x) {
    return level - static_cast<double>(mask(Vec3(x.x(), x.y(), x.z())));
  };
  CGAL::get_default_random() = CGAL::Random(kSeed);
  CGAL::Random rays(kSeed);
  const auto region_at = [&](const Kernel::Point_3& x) {
    return outside_positive(x) > 0.0 ? 0 : division->region(Vec3(x.x(), x.y(), x.z()));
  };
  const Domain domain = division == nullptr
                            ? Domain::create_implicit_mesh_domain(
                                  outside_positive, enclosure.bbox(),
                                  p::relative_error_bound = kSurfaceTolerance, p::p_rng = &rays)
                            : Domain(region_at, enclosure.bbox(),
                                     p::relative_error_bound = kSurfaceTolerance, p::p_rng = &rays);
  const ScaledField facet_radius{&edge_mm, kFacetRadiusOverEdge};
  const ScaledField cell_radius{&edge_mm, kCellRadiusOverEdge};
  const ScaledField facet_distance{&edge_mm, kFacetDistanceOverEdge, division};
  const Criteria criteria(p::facet_angle = kFacetAngle_deg, p::facet_size = facet_radius,
                          p::facet_distance = facet_distance,
                          p::cell_radius_edge_ratio = kCellRadiusEdgeRatio,
                          p::cell_size = cell_radius);

  report(progress, "mesh: refine", 0.0);
  // Interfaces that meet are no manifolds.
  Complex complex = division == nullptr
                        ? CGAL::make_mesh_3<Complex>(domain, criteria, p::no_perturb(),
                                                     p::no_exude(), begin, p::manifold())
                        : CGAL::make_mesh_3<Complex>(domain, criteria, p::no_perturb(),
                                                     p::no_exude(), begin, p::non_manifold());
  if (!(options.sliver_bound_deg > 0.0)) return complex;
  report(progress, "mesh: perturb", 0.5);
  CGAL::perturb_mesh_3(complex, domain, p::sliver_bound = options.sliver_bound_deg);
  report(progress, "mesh: exude", 0.8);
  CGAL::exude_mesh_3(complex, p::sliver_bound = options.sliver_bound_deg);
  return complex;
}

TetMesh extract(const Complex& complex, bool labelled) {
  TetMesh mesh;
  const auto count = static_cast<Eigen::Index>(complex.number_of_cells_in_complex());
  mesh.tets.resize(4, count);
  std::unordered_map<Triangulation::Vertex_handle, int, CGAL::Handle_hash_function> index;
  std::vector<Vec3> nodes;
  Eigen::Index t = 0;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end();
       ++cell, ++t) {
    if (labelled) mesh.labels.push_back(complex.subdomain_index(cell));
    for (int a = 0; a < 4; ++a) {
      const auto vertex = cell->vertex(a);
      const auto [entry, added] = index.try_emplace(vertex, static_cast<int>(nodes.size()));
      if (added) nodes.emplace_back(vertex->point().x(), vertex->point().y(), vertex->point().z());
      mesh.tets(a, t) = entry->second;
    }
  }
  mesh.nodes.resize(3, static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t n = 0; n < nodes.size(); ++n)
    mesh.nodes.col(static_cast<Eigen::Index>(n)) = nodes[n];
  return mesh;
}

void keep_largest_component(TetMesh& mesh) {
  const TetComponents parts = tet_components(mesh.tets);
  if (parts.sizes.size() < 2) return;
  const auto largest = static_cast<int>(std::max_element(parts.sizes.begin(), parts.sizes.end()) -
                                        parts.sizes.begin());
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t)
    if (parts.component_of_tet[static_cast<std::size_t>(t)] == largest) {
      if (!mesh.labels.empty())
        mesh.labels[static_cast<std::size_t>(kept)] = mesh.labels[static_cast<std::size_t>(t)];
      mesh.tets.col(kept++) = mesh.tets.col(t).eval();
    }
  mesh.tets.conservativeResize(4, kept);
  if (!mesh.labels.empty()) mesh.labels.resize(static_cast<std::size_t>(kept));
}

// Interleaves the bits of three 21-bit coordinates.
std::uint64_t morton_code(const Vec3& x, const Vec3& low, double extent) {
  std::uint64_t code = 0;
  std::array<std::uint64_t, 3> cell{};
  for (int a = 0; a < 3; ++a) {
    const double scaled = (x[a] - low[a]) / extent * 2097151.0;
    cell[static_cast<std::size_t>(a)] =
        static_cast<std::uint64_t>(std::clamp(scaled, 0.0, 2097151.0));
  }
  for (int bit = 20; bit >= 0; --bit)
    for (std::size_t a = 0; a < 3; ++a) code = (code << 1) | ((cell[a] >> bit) & 1U);
  return code;
}

// Drops unused nodes and numbers the rest along the Morton curve.
void renumber_nodes(TetMesh& mesh) {
  const Vec3 low = mesh.nodes.rowwise().minCoeff();
  const double extent = std::max((mesh.nodes.rowwise().maxCoeff() - low).maxCoeff(), 1e-300);
  struct Key {
    std::uint64_t code;
    std::array<double, 3> x;  // separates nodes within one cell of the curve
    int node;
  };
  std::vector<char> used(static_cast<std::size_t>(mesh.num_nodes()), 0);
  for (const int n : mesh.tets.reshaped()) used[static_cast<std::size_t>(n)] = 1;
  std::vector<Key> keys;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    if (!used[static_cast<std::size_t>(n)]) continue;
    const Vec3 x = mesh.nodes.col(n);
    keys.push_back({morton_code(x, low, extent), {x[0], x[1], x[2]}, n});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return std::tie(a.code, a.x) < std::tie(b.code, b.x);
  });
  Points nodes(3, static_cast<Eigen::Index>(keys.size()));
  std::vector<int> new_index(used.size(), -1);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    nodes.col(static_cast<Eigen::Index>(k)) = mesh.nodes.col(keys[k].node);
    new_index[static_cast<std::size_t>(keys[k].node)] = static_cast<int>(k);
  }
  mesh.nodes = std::move(nodes);
  for (int& n : mesh.tets.reshaped()) n = new_index[static_cast<std::size_t>(n)];
}

// One canonical form per tetrahedron (lowest node first, positive), sorted.
void sort_tets(TetMesh& mesh) {
  std::vector<std::pair<std::array<int, 4>, int>> tets(static_cast<std::size_t>(mesh.num_tets()));
  for (std::size_t t = 0; t < tets.size(); ++t) {
    auto& [tet, label] = tets[t];
    if (!mesh.labels.empty()) label = mesh.labels[t];
    for (int a = 0; a < 4; ++a)
      tet[static_cast<std::size_t>(a)] = mesh.tets(a, static_cast<Eigen::Index>(t));
    std::sort(tet.begin(), tet.end());
    const Vec3 x0 = mesh.nodes.col(tet[0]);
    const Vec3 a = mesh.nodes.col(tet[1]) - x0;
    const Vec3 b = mesh.nodes.col(tet[2]) - x0;
    const Vec3 c = mesh.nodes.col(tet[3]) - x0;
    if (a.cross(b).dot(c) < 0.0) std::swap(tet[2], tet[3]);
  }
  std::sort(tets.begin(), tets.end());
  for (std::size_t t = 0; t < tets.size(); ++t) {
    mesh.tets.col(static_cast<Eigen::Index>(t)) = Eigen::Map<Eigen::Vector4i>(tets[t].first.data());
    if (!mesh.labels.empty()) mesh.labels[t] = tets[t].second;
  }
}

Result<TetMesh> mesh_domain(const VoxelImage& smooth_mask, const Division* division,
                            const SizingField& edge_mm, const MeshingOptions& options,
                            const Progress& progress) {
  const auto enclosure = enclose(smooth_mask, options.level);
  if (!enclosure)
    return fail(ErrorCode::kEmptySet,
                fmt::format("mask: no voxel is > {} after smoothing", options.level));
  TetMesh mesh;
  try {
    mesh = extract(refine(smooth_mask, *enclosure, division, edge_mm, options, progress),
                   division != nullptr);
  } catch (const CGAL::Failure_exception& failure) {
    return fail(ErrorCode::kDegenerateMesh,
                fmt::format("mesh generation failed: {} does not hold", failure.expression()));
  }
  if (mesh.num_tets() > 0) {
    keep_largest_component(mesh);
    renumber_nodes(mesh);
    sort_tets(mesh);
  }
  if (Status status = check_mesh(mesh); !status)
    return fail(status.error().code, "generated " + status.error().message);
  report(progress, "mesh: done", 1.0);
  return mesh;
}

}  // namespace

Result<TetMesh> mesh_mask(const VoxelImage& smooth_mask, const SizingField& edge_mm,
                          const MeshingOptions& options, const Progress& progress) {
  return mesh_domain(smooth_mask, nullptr, edge_mm, options, progress);
}

Result<TetMesh> mesh_regions(const VoxelImage& smooth_mask, const RegionField& region,
                             const std::function<bool(int, int)>& loose, const SizingField& edge_mm,
                             const MeshingOptions& options, const Progress& progress) {
  const Division division{region, loose};
  return mesh_domain(smooth_mask, &division, edge_mm, options, progress);
}

}  // namespace brainshift::geometry
