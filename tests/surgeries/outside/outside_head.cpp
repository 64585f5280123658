// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/outside/outside_head.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/tools/twin/sheets.hpp"
#include "client/tools/twin/stiffness.hpp"
#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::outside {
namespace {

constexpr double kGreyDepth_mm = 4.0;
constexpr double kPerKpa = 1e-3;  // kPa/mm -> N/mm^3
constexpr double kCavityShear = 1e-3;

enum class Hold : char { kInner, kFree, kWall, kBase, kStem };

Vec3 centre_of(const TetMesh& mesh, int tet) {
  return mesh.nodes(Eigen::all, mesh.tets.col(tet)).rowwise().mean();
}

double within(Random& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

// How a middle of an edge is held: as what holds most.
Hold firmer(Hold a, Hold b) { return std::max(a, b); }

struct Surface {
  std::vector<Hold> hold;  // per node of the space
  Points area;             // outward area vector of each node, mm^2: the middles of edges carry it
};

Surface surface_of(const client::OtherMesh& mesh) {
  const BrainModel& model = mesh.model;
  const fem::DisplacementSpace& space = mesh.space;
  Surface surface{std::vector<Hold>(static_cast<std::size_t>(space.num_nodes()), Hold::kInner),
                  Points::Zero(3, space.num_nodes())};
  const auto set = [&](const std::vector<NodeIndex>& nodes, Hold hold) {
    for (const NodeIndex node : nodes) surface.hold[static_cast<std::size_t>(node)] = hold;
  };
  set(model.craniotomy, Hold::kFree);
  set(model.brainstem, Hold::kStem);
  set(model.slaves, Hold::kWall);
  set(model.fixed, Hold::kBase);
  for (Eigen::Index f = 0; f < model.boundary_triangles.cols(); ++f) {
    const Eigen::Vector3i face = model.boundary_triangles.col(f);
    const auto nodes = fem::face_nodes(space, face);
    const Vec3 a = space.nodes.col(face[0]);
    const Vec3 area =
        0.5 * Vec3(space.nodes.col(face[1]) - a).cross(Vec3(space.nodes.col(face[2]) - a));
    for (int k = 0; k < 3; ++k) {
      const int edge = nodes[static_cast<std::size_t>(3 + k)];
      surface.area.col(edge) += area / 3.0;
      surface.hold[static_cast<std::size_t>(edge)] =
          firmer(surface.hold[static_cast<std::size_t>(face[k])],
                 surface.hold[static_cast<std::size_t>(face[(k + 1) % 3])]);
    }
  }
  return surface;
}

}  // namespace

Result<OutsideHead> make_outside_head(const BrainModel& model, const CaseConfig& config) {
  Result<BrainModel> other = model;
  if (model.mesh.num_nodes() >= kOwnMesh) other = client::mesh_anew(config);
  if (!other) return tl::unexpected(other.error());
  auto mesh = client::make_other_mesh(model, std::move(*other));
  if (!mesh) return tl::unexpected(mesh.error());
  OutsideHead head{*mesh, config, {}, {}, 1.0, {}, {}, {}, {}, {}};
  const TetMesh& body = head.mesh->model.mesh;
  head.low = model.mesh.nodes.rowwise().minCoeff();
  head.high = model.mesh.nodes.rowwise().maxCoeff();
  head.opening_nodes = model.mesh.nodes(Eigen::all, model.craniotomy);
  head.opening = head.opening_nodes.rowwise().mean();
  head.tumour = model.tumour.vertices.rowwise().mean();
  head.opening_side = head.opening[0] < head.middle()[0] ? -1.0 : 1.0;
  const BrainModel& own = head.mesh->model;
  Eigen::Matrix<int, 3, Eigen::Dynamic> cortex(
      3, own.boundary_triangles.cols() + own.septa.triangles.cols());
  cortex << own.boundary_triangles, own.septa.triangles;
  const auto surface = geometry::ClosestPointIndex::build(geometry::surface_of(body.nodes, cortex));
  if (!surface) return tl::unexpected(surface.error());
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  if (!tumour) return tl::unexpected(tumour.error());
  for (int t = 0; t < body.num_tets(); ++t) {
    const Vec3 x = centre_of(body, t);
    head.grey.push_back(surface->closest(x).distance_mm < kGreyDepth_mm ? 1 : 0);
    head.in_tumour.push_back(tumour->contains(x) ? 1 : 0);
  }
  return head;
}

Region ventricles(const OutsideHead& head, int half) {
  const Vec3 middle = head.middle() + Vec3(0.0, 0.02, 0.08).cwiseProduct(head.extent());
  const Vec3 axes = Vec3(0.07, 0.16, 0.085).cwiseProduct(head.extent());
  const double beside = 0.1 * head.extent()[0], sign = head.opening_side;
  return [=](const Vec3& x) {
    for (const int side : {-1, 1}) {
      if (half != 0 && side != half) continue;
      const Vec3 centre = middle + Vec3(sign * side * beside, 0.0, 0.0);
      if ((x - centre).cwiseQuotient(axes).squaredNorm() < 1.0) return true;
    }
    return false;
  };
}

bool on_falx(const OutsideHead& head, const Vec3& x, double half_width_mm) {
  const Vec3 part = (x - head.middle()).cwiseQuotient(0.5 * head.extent());
  return std::abs(x[0] - head.middle()[0]) < half_width_mm && part[2] > -0.1 &&
         std::hypot(part[1], part[2]) > 0.55;
}

Vec3 tentorium_normal() { return Vec3(0.0, -0.4, 1.0).normalized(); }

bool on_tentorium(const OutsideHead& head, const Vec3& x, double half_width_mm) {
  const Vec3 hinge = head.middle() + Vec3(0.0, -0.3, -0.2).cwiseProduct(head.extent());
  return x[1] < head.middle()[1] - 0.12 * head.extent()[1] &&
         std::abs(tentorium_normal().dot(x - hinge)) < half_width_mm;
}

fem::MaterialMap tissue_of(const OutsideHead& head, const Changes& changes, std::uint64_t seed) {
  Random random(seed + 11);
  const client::GaussianField field(20.0, random.index(1u << 30));
  const double poisson = within(random, 0.45, 0.48);
  const double patient = std::exp(0.2 * random.normal());
  const double grey = within(random, 0.8, 1.1), white = within(random, 1.1, 1.5);
  const double tumour = within(random, 0.8, 2.5), ventricle = within(random, 0.04, 0.08);
  const Region fluid = ventricles(head, 0);
  const TetMesh& mesh = head.mesh->model.mesh;
  fem::MaterialMap map;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const auto at = static_cast<std::size_t>(t);
    const Vec3 x = centre_of(mesh, t);
    const bool in_fluid = !head.has_cavities() && fluid(x) && head.in_tumour[at] == 0;
    const double factor = head.in_tumour[at] != 0 ? tumour
                          : in_fluid              ? ventricle
                          : head.grey[at] != 0    ? grey
                                                  : white;
    Material material = head.config.material;
    material.shear_modulus_pa *= patient * factor * std::exp(0.3 * field.at(x));
    material.poisson_ratio = in_fluid ? 0.3 : poisson;
    if (changes.softer) material.shear_modulus_pa *= changes.softer(x);
    if (!changes.cavity.empty() && changes.cavity[at] != 0) {
      material.shear_modulus_pa = kCavityShear * head.config.material.shear_modulus_pa;
      material.poisson_ratio = 0.0;
    }
    map.materials.push_back(fem::poro_material_from(material));
    map.of_tet.push_back(t);
  }
  return map;
}

Supports supports_of(const OutsideHead& head, const Changes& changes, std::uint64_t seed) {
  Random random(seed + 23);
  const double base = 0.5 * kPerKpa * std::exp(0.5 * random.normal());
  const client::GaussianField gap(30.0, random.index(1u << 30));
  const client::GaussianField sheet_gap(30.0, random.index(1u << 30));
  const fem::DisplacementSpace& space = head.space();
  const Surface surface = surface_of(*head.mesh);
  Supports supports{fem::DofMap(space.num_nodes()), {}, {}};
  const bool sheets = changes.sheets && !head.has_sheets();
  // A sheet of one layer of nodes: vertices and middles lie about half an edge apart.
  const double edge = std::cbrt(head.extent().prod() / space.num_vertices());
  for (int node = 0; node < space.num_nodes(); ++node) {
    const Vec3 x = space.nodes.col(node);
    if (sheets && on_falx(head, x, 0.25 * edge)) {
      supports.dofs.fix_normal(node, Vec3::UnitX());
    } else if (sheets && on_tentorium(head, x, 0.25 * edge)) {
      supports.dofs.fix_normal(node, tentorium_normal());
    }
    const double area = surface.area.col(node).norm();
    if (!(area > 0.0)) continue;
    const Vec3 n = surface.area.col(node) / area;
    const Mat3 along = n * n.transpose(), across = Mat3::Identity() - along;
    switch (surface.hold[static_cast<std::size_t>(node)]) {
      case Hold::kBase:
        supports.springs.push_back({node, base * area * (along + 0.1 * across)});
        break;
      case Hold::kStem:
        supports.springs.push_back({node, kPerKpa * area * Mat3::Identity()});
        break;
      case Hold::kWall:
        supports.springs.push_back({node, 0.01 * kPerKpa * area * across});
        supports.sides.push_back({node, n, 0.3 + 2.2 * client::normal_cdf(gap.at(x))});
        break;
      case Hold::kFree:
      case Hold::kInner: break;
    }
  }
  // Slits of the mesh: sides by vertices too, whose tissue would bulge through a thin sheet.
  for (const client::SheetNode& side : client::sheet_nodes(head.mesh->model.septa, space)) {
    const double part = client::normal_cdf(sheet_gap.at(space.nodes.col(side.node)));
    supports.sides.push_back({side.node, side.normal, 0.2 + part});
  }
  supports.dofs.finalise();
  return supports;
}

}  // namespace brainshift::outside
