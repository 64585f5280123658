// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/brain_model_builder.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "common/anatomy/brain_mesh.hpp"
#include "common/anatomy/septa.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/misplacement.hpp"
#include "common/geometry/surface.hpp"
#include "common/values/model_id.hpp"

namespace brainshift::anatomy {
namespace {

// Deep enough for the curvature of a head under a large opening (45 mm across: 4 mm), shallow
// enough not to reach another gyrus' inner wall or the far side.
constexpr double kLargestHeight_mm = 15.0;
// cos 60 degrees. A node whose normal turns further belongs to the wall of a sulcus or the far
// side.
constexpr double kMinCosine = 0.5;

// Bounds of a head's skull, perhaps open.
constexpr double kSmallestSkull_mm = 20.0;
constexpr double kLargestSkull_mm = 500.0;
// Atrophy leaves up to a centimetre between brain and skull.
constexpr double kFarthestSkull_mm = 15.0;
// A node that stands deeper than this makes every update unusable (values/quality.hpp).
constexpr double kDeepest_mm = 3.0;

// Width of the Gaussian that smooths regions, at least.
constexpr double kSmoothingOverEdge = 0.35;

enum class Role { kNone, kCraniotomy, kBrainstem };

// The frame of the opening: origin on the surface, along and across in the tangent plane.
struct Opening {
  Vec3 origin = Vec3::Zero();
  Vec3 along = Vec3::Zero();
  Vec3 across = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
};

std::string text(const Vec3& x) { return fmt::format("[{:g}, {:g}, {:g}]", x[0], x[1], x[2]); }

Result<Opening> place_opening(const BrainSurface& brain, const Craniotomy& craniotomy) {
  const auto index = geometry::ClosestPointIndex::build(brain.surface);
  if (!index) return tl::unexpected(index.error());
  const geometry::ClosestPoint nearest = index->closest(craniotomy.centre_mm);
  if (nearest.distance_mm > 0.5 * craniotomy.long_axis_mm)
    return fail(ErrorCode::kEmptySet,
                fmt::format("craniotomy.centre_mm = {} selects no boundary node; the nearest "
                            "boundary point is {:.1f} mm away",
                            text(craniotomy.centre_mm), nearest.distance_mm));
  Opening opening;
  opening.origin = nearest.point;
  const Vec3 facing = index->triangle_normal(nearest.triangle);
  Vec3 sum = Vec3::Zero();
  for (int v = 0; v < brain.surface.num_vertices(); ++v) {
    const Vec3 normal = brain.normals.col(v);
    const double distance = (brain.surface.vertices.col(v) - opening.origin).norm();
    // Walls that face away belong to another part of the surface.
    if (distance <= 0.5 * craniotomy.short_axis_mm && normal.dot(facing) > 0.0) sum += normal;
  }
  opening.normal = sum.norm() > 0.0 ? Vec3(sum.normalized()) : facing;
  const Vec3 wanted = craniotomy.long_axis_direction.normalized();
  const Vec3 along = wanted - opening.normal * opening.normal.dot(wanted);
  if (!(along.norm() > 1e-3))
    return invalid(
        fmt::format("craniotomy.long_axis_direction = {}: is perpendicular to the brain "
                    "surface at craniotomy.centre_mm",
                    text(craniotomy.long_axis_direction)));
  opening.along = along.normalized();
  opening.across = opening.normal.cross(opening.along);
  return opening;
}

bool in_opening(const Opening& opening, const Craniotomy& craniotomy, const Vec3& x,
                const Vec3& normal) {
  const Vec3 offset = x - opening.origin;
  const double u = offset.dot(opening.along) / (0.5 * craniotomy.long_axis_mm);
  const double v = offset.dot(opening.across) / (0.5 * craniotomy.short_axis_mm);
  return u * u + v * v <= 1.0 && std::abs(offset.dot(opening.normal)) <= kLargestHeight_mm &&
         normal.dot(opening.normal) >= kMinCosine;
}

// Roles of the surface vertices as far as their place decides them.
Result<std::vector<Role>> place_roles(const BrainSurface& brain, const CaseConfig& config) {
  const auto opening = place_opening(brain, config.craniotomy);
  if (!opening) return tl::unexpected(opening.error());
  std::vector<Role> roles(brain.node_of_vertex.size(), Role::kNone);
  for (std::size_t v = 0; v < roles.size(); ++v) {
    const Vec3 x = brain.surface.vertices.col(static_cast<Eigen::Index>(v));
    const Vec3 normal = brain.normals.col(static_cast<Eigen::Index>(v));
    if (in_opening(*opening, config.craniotomy, x, normal)) {
      roles[v] = Role::kCraniotomy;
    } else if ((x - config.brainstem.centre_mm).norm() <= config.brainstem.radius_mm) {
      roles[v] = Role::kBrainstem;
    }
  }
  if (std::find(roles.begin(), roles.end(), Role::kCraniotomy) == roles.end())
    return fail(ErrorCode::kEmptySet,
                fmt::format("craniotomy.centre_mm = {} with axes {:g} x {:g} mm selects no "
                            "boundary node; the nearest boundary point is {:.1f} mm away",
                            text(config.craniotomy.centre_mm), config.craniotomy.long_axis_mm,
                            config.craniotomy.short_axis_mm,
                            (opening->origin - config.craniotomy.centre_mm).norm()));
  if (config.brainstem.radius_mm > 0.0 &&
      std::find(roles.begin(), roles.end(), Role::kBrainstem) == roles.end())
    return fail(ErrorCode::kEmptySet,
                fmt::format("brainstem.centre_mm = {} with radius {:g} mm selects no boundary node",
                            text(config.brainstem.centre_mm), config.brainstem.radius_mm));
  return roles;
}

// How the nodes that may touch the skull stand to it.
struct SkullFit {
  double median_mm = 0.0;   // of their distances from it
  double deepest_mm = 0.0;  // how far one stands outside of it
  int outside = 0;
  bool turned = false;  // the skull's normals look inwards
};

// The skull may be open (with its craniotomy), so the sign of its volume cannot say where it
// looks; the brain beneath it can.
Result<SkullFit> fit_of_skull(const TriangleSurface& skull, const BrainSurface& brain,
                              const std::vector<NodeIndex>& slaves) {
  const auto index = geometry::ClosestPointIndex::build(skull);
  if (!index) return tl::unexpected(index.error());
  double agreement = 0.0;
  std::vector<double> distances, gaps;
  for (int v = 0; v < brain.surface.num_vertices(); ++v) {
    const Vec3 x = brain.surface.vertices.col(v);
    const auto nearest = index->closest(x);
    const Vec3 normal = index->triangle_normal(nearest.triangle);
    agreement += normal.dot(brain.normals.col(v));
    const NodeIndex node = brain.node_of_vertex[static_cast<std::size_t>(v)];
    if (!std::binary_search(slaves.begin(), slaves.end(), node)) continue;
    distances.push_back(nearest.distance_mm);
    gaps.push_back(normal.dot(nearest.point - x));
  }
  SkullFit fit;
  fit.turned = agreement < 0.0;
  for (const double gap : gaps) {
    const double depth = fit.turned ? gap : -gap;
    fit.outside += depth > 0.0 ? 1 : 0;
    fit.deepest_mm = std::max(fit.deepest_mm, depth);
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  fit.median_mm = *middle;
  return fit;
}

// A given skull against the brain, with its normals turned outwards. kInvalidArgument names the
// key.
Result<TriangleSurface> checked_skull(TriangleSurface skull, const BrainSurface& brain,
                                      const std::vector<NodeIndex>& slaves, const std::string& what,
                                      Notes* notes) {
  if (Status whole = check_surface(skull, what); !whole) return tl::unexpected(whole.error());
  const Vec3 size = skull.vertices.rowwise().maxCoeff() - skull.vertices.rowwise().minCoeff();
  const Status extent = check_extent(size, what + ": skull", kSmallestSkull_mm, kLargestSkull_mm);
  if (!extent) return tl::unexpected(extent.error());
  if (const int edges = geometry::turned_edges(skull); edges > 0) {
    return invalid(fmt::format(
        "{}: {} edges join triangles whose normals look to opposite sides: parts of the skull are "
        "turned inside out",
        what, edges));
  }
  const auto fit = fit_of_skull(skull, brain, slaves);
  if (!fit) return fail(fit.error().code, what + ": " + fit.error().message);
  const bool near = fit->median_mm <= kFarthestSkull_mm;
  if (!near || fit->deepest_mm > kDeepest_mm) {
    const std::string mistake = geometry::likely_mistake(skull.vertices, [&](const Points& meant) {
      const auto other = fit_of_skull({meant, skull.triangles}, brain, slaves);
      return other && other->median_mm <= kFarthestSkull_mm && other->deepest_mm <= kDeepest_mm;
    });
    if (!near) {
      return invalid(fmt::format(
          "{}: the skull lies {:.1f} mm from the brain (median over the nodes that may touch it): "
          "must be at most {:g} mm{}",
          what, fit->median_mm, kFarthestSkull_mm, mistake));
    }
    return invalid(fmt::format(
        "{}: {} of {} nodes of the brain that may touch the skull stand outside of it, by up to "
        "{:.1f} mm: must be at most {:g} mm{}",
        what, fit->outside, slaves.size(), fit->deepest_mm, kDeepest_mm, mistake));
  }
  if (fit->outside > 0) {
    add_note(notes, fmt::format("{}: {} of {} nodes of the brain that may touch the skull stand "
                                "outside of it before surgery, by up to {:.2f} mm",
                                what, fit->outside, slaves.size(), fit->deepest_mm));
  }
  if (fit->turned) skull.triangles.row(1).swap(skull.triangles.row(2));
  return skull;
}

// The patient's own inner skull surface, or the brain's surface moved outwards by the gap.
Result<TriangleSurface> make_skull(const CaseInputs& inputs, const BrainSurface& brain,
                                   const NodeSets& sets, Notes* notes) {
  const ContactConfig& contact = inputs.config.contact;
  if (!contact.skull_file) return geometry::offset_surface(brain.surface, contact.gap_mm);
  const std::string what = fmt::format("contact.skull_file = '{}'", contact.skull_file->string());
  if (!inputs.skull) return invalid(what + ": was not read");
  std::vector<NodeIndex> slaves = sets.slaves;
  std::sort(slaves.begin(), slaves.end());
  return checked_skull(*inputs.skull, brain, slaves, what, notes);
}

// Distance grid of the tumour, for fast alignment. It is empty for a segmentation whose parts
// touch along an edge: such a surface is not closed in the strict sense, and alignment then
// searches its triangles.
Result<DistanceGrid> tumour_distances(const TriangleSurface& tumour) {
  if (!geometry::is_closed(tumour)) return DistanceGrid{};
  const auto index = geometry::ClosestPointIndex::build(tumour);
  if (!index) return tl::unexpected(index.error());
  return geometry::signed_distance_grid(*index);
}

std::string named_labels(const CaseConfig& config) {
  return fmt::format("anatomy.labels = '{}'", config.anatomy.labels->string());
}

// Null without a label map, or where nothing of it is asked for.
Result<std::unique_ptr<Regions>> regions_of(const CaseInputs& inputs, const TriangleSurface& tumour,
                                            Notes* notes) {
  const AnatomyConfig& wanted = inputs.config.anatomy;
  const bool any = wanted.tissues || wanted.septa || wanted.ventricles;
  if (!wanted.labels || !any) return std::unique_ptr<Regions>();
  const std::string what = named_labels(inputs.config);
  if (!inputs.labels) return invalid(what + ": was not read");
  const auto& settings = std::get<MeshGeneration>(inputs.config.mesh);
  auto made = Regions::build(inputs, tumour,
                             std::max(settings.smoothing_mm, kSmoothingOverEdge * settings.edge_mm),
                             what, notes);
  if (!made) return tl::unexpected(made.error());
  return std::make_unique<Regions>(std::move(*made));
}

// The sets of a mesh that was cut: the copies of a node that lie on the outer surface.
void follow(NodeSets& sets, const geometry::SlitMesh& cut) {
  std::vector<char> outer(static_cast<std::size_t>(cut.mesh.num_nodes()), 0);
  for (const int node : cut.outer.reshaped()) outer[static_cast<std::size_t>(node)] = 1;
  for (auto* set : {&sets.craniotomy, &sets.brainstem, &sets.slaves, &sets.fixed}) {
    std::vector<NodeIndex> nodes;
    for (const NodeIndex node : *set) {
      for (const NodeIndex copy : cut.copies[static_cast<std::size_t>(node)]) {
        if (outer[static_cast<std::size_t>(copy)] != 0) nodes.push_back(copy);
      }
    }
    std::sort(nodes.begin(), nodes.end());
    *set = std::move(nodes);
  }
}

// Nodes that are held along the skull's normal are no slaves of a sheet: contact needs free ones.
Septa septa_of(const geometry::SlitMesh& cut, const std::vector<NodeIndex>& fixed, double gap_mm) {
  Septa septa;
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < cut.side_nodes.size(); ++i) {
    if (std::binary_search(fixed.begin(), fixed.end(), cut.side_nodes[i])) continue;
    septa.slaves.push_back(cut.side_nodes[i]);
    columns.push_back(static_cast<Eigen::Index>(i));
  }
  septa.normals = cut.side_normals(Eigen::all, columns);
  septa.gap_mm = gap_mm;
  septa.triangles = cut.sheets;
  return septa;
}

}  // namespace

BrainSurface brain_surface_of(const TetMesh& mesh) {
  BrainSurface brain;
  brain.surface = geometry::boundary_surface(mesh, &brain.node_of_vertex);
  brain.normals = geometry::vertex_normals(brain.surface);
  return brain;
}

Result<NodeSets> select_node_sets(const BrainSurface& brain, const CaseConfig& config) {
  const auto roles = place_roles(brain, config);
  if (!roles) return tl::unexpected(roles.error());
  const VecX depth = brain.surface.vertices.transpose() * config.gravity_direction.normalized();

  NodeSets sets;
  sets.fluid_plane_depth_mm = -std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < roles->size(); ++v)
    if ((*roles)[v] == Role::kCraniotomy)
      sets.fluid_plane_depth_mm =
          std::max(sets.fluid_plane_depth_mm, depth[static_cast<Eigen::Index>(v)]);
  sets.slave_plane_depth_mm = sets.fluid_plane_depth_mm + config.contact.slave_depth_mm;

  for (std::size_t v = 0; v < roles->size(); ++v) {
    const NodeIndex node = brain.node_of_vertex[v];
    switch ((*roles)[v]) {
      case Role::kCraniotomy: sets.craniotomy.push_back(node); break;
      case Role::kBrainstem: sets.brainstem.push_back(node); break;
      case Role::kNone:
        (depth[static_cast<Eigen::Index>(v)] < sets.slave_plane_depth_mm ? sets.slaves : sets.fixed)
            .push_back(node);
    }
  }
  if (sets.slaves.empty())
    return fail(ErrorCode::kEmptySet,
                fmt::format("contact.slave_depth_mm = {:g}: no boundary node lies above the second "
                            "plane, so there is no slave",
                            config.contact.slave_depth_mm));
  if (sets.fixed.empty())
    return fail(ErrorCode::kEmptySet,
                fmt::format("contact.slave_depth_mm = {:g}: no boundary node lies below the second "
                            "plane, so nothing is fixed",
                            config.contact.slave_depth_mm));
  return sets;
}

Result<BrainModel> build_brain_model(const CaseInputs& inputs, const Progress& progress,
                                     std::vector<std::string>* notes) {
  const CaseConfig& config = inputs.config;
  if (Status status = validate(config); !status) return tl::unexpected(status.error());

  report(progress, "tumour surface", 0.0);
  auto tumour = make_tumour_surface(inputs, notes);
  if (!tumour) return tl::unexpected(tumour.error());

  auto regions = regions_of(inputs, *tumour, notes);
  if (!regions) return tl::unexpected(regions.error());
  auto mesh = make_brain_mesh(inputs, *tumour, progress, notes, regions->get());
  if (!mesh) return tl::unexpected(mesh.error());
  auto fitted = fit_tumour(std::move(*tumour), *mesh, config);
  if (!fitted) return tl::unexpected(fitted.error());
  if (notes != nullptr && !fitted->note.empty()) notes->push_back(fitted->note);

  report(progress, "node sets", 0.0);
  const BrainSurface brain = brain_surface_of(*mesh);
  auto sets = select_node_sets(brain, config);
  if (!sets) return tl::unexpected(sets.error());
  auto skull = make_skull(inputs, brain, *sets, notes);
  if (!skull) return tl::unexpected(skull.error());

  report(progress, "tumour distances", 0.0);
  auto distances = tumour_distances(fitted->surface);
  if (!distances) return fail(distances.error().code, "tumour: " + distances.error().message);

  BrainModel model;
  model.case_id = config.case_id;
  if (*regions) {
    report(progress, "falx, tentorium, ventricles", 0.0);
    auto cut = with_septa_and_ventricles(*mesh, **regions, config.anatomy, fitted->surface,
                                         named_labels(config), notes);
    if (!cut) return tl::unexpected(cut.error());
    follow(*sets, *cut);
    model.septa = septa_of(*cut, sets->fixed, config.anatomy.septum_gap_mm);
    model.mesh = std::move(cut->mesh);
    model.boundary_triangles = std::move(cut->outer);
    model.ventricle_wall = std::move(cut->wall);
  } else {
    model.boundary_triangles = geometry::boundary_triangles(*mesh);
    model.mesh = std::move(*mesh);
  }
  model.skull = std::move(*skull);
  model.tumour = std::move(fitted->surface);
  model.tumour_distance = std::move(*distances);
  model.craniotomy = std::move(sets->craniotomy);
  model.brainstem = std::move(sets->brainstem);
  model.slaves = std::move(sets->slaves);
  model.fixed = std::move(sets->fixed);
  model.gravity_direction = config.gravity_direction.normalized();
  model.fluid_plane_depth_mm = sets->fluid_plane_depth_mm;
  model.slave_plane_depth_mm = sets->slave_plane_depth_mm;
  model.model_id = content_hash(model);
  report(progress, "brain model", 1.0);
  return model;
}

}  // namespace brainshift::anatomy
