// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/preview/case_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "common/anatomy/brain_labels.hpp"
#include "common/anatomy/brain_mesh.hpp"
#include "common/anatomy/brain_model_builder.hpp"
#include "common/anatomy/given_inputs.hpp"
#include "common/anatomy/mask_leak.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/geometry/label_map_file.hpp"

namespace brainshift::client {
namespace {

constexpr double kMiddle_mm = 10.0;
constexpr double kFarOpening_mm = 60.0;
constexpr double kShortBrain_mm = 100.0;
constexpr double kLongBrain_mm = 220.0;
constexpr double kLargeTumour = 0.1;  // of the brain's volume
constexpr double kFewSlaves = 0.01;   // of the surface's nodes
constexpr double kMm3PerCc = 1000.0, kMm2PerCm2 = 100.0;
constexpr double kFarProjection_mm = 10.0;
constexpr double kSmallBrain_cc = 900.0, kLargeBrain_cc = 1900.0;
constexpr double kAcross_mm = 3.0;  // from the surface, where the MRI is looked at
constexpr double kDark = 0.3;       // of the median
constexpr double kLeastContrast = 0.2, kLargestDark = 0.15;

void set_roles(CaseView& view, const std::vector<NodeIndex>& node_of_vertex,
               const std::vector<NodeIndex>& craniotomy, const std::vector<NodeIndex>& brainstem,
               const std::vector<NodeIndex>& slaves) {
  std::map<NodeIndex, NodeRole> role_of;
  for (const NodeIndex node : craniotomy) role_of[node] = NodeRole::kCraniotomy;
  for (const NodeIndex node : brainstem) role_of[node] = NodeRole::kBrainstem;
  for (const NodeIndex node : slaves) role_of[node] = NodeRole::kSlave;
  for (const NodeIndex node : node_of_vertex) {
    const auto found = role_of.find(node);
    view.roles.push_back(found == role_of.end() ? NodeRole::kFixed : found->second);
  }
}

void take_model(CaseView& view, const BrainModel& model) {
  std::vector<NodeIndex> node_of_vertex;
  view.tumour = model.tumour;
  view.brain = geometry::surface_of(model.mesh.nodes, model.boundary_triangles, &node_of_vertex);
  view.septa = {model.mesh.nodes, model.septa.triangles};
  view.ventricles = {model.mesh.nodes, model.ventricle_wall};
  view.nodes = model.mesh.num_nodes();
  view.tets = model.mesh.num_tets();
  set_roles(view, node_of_vertex, model.craniotomy, model.brainstem, model.slaves);
  view.fluid_plane_depth_mm = model.fluid_plane_depth_mm;
  view.slave_plane_depth_mm = model.slave_plane_depth_mm;
}

// 1 where `is` takes a value; none where it takes no value.
template <typename Is>
std::optional<VoxelImage> mask_of(VoxelImage image, const Is& is) {
  bool any = false;
  for (float& v : image.values) {
    const bool in = std::isfinite(v) && is(v);
    any = any || in;
    v = in ? 1.0F : 0.0F;
  }
  return any ? std::optional(std::move(image)) : std::nullopt;
}

int label_of(float value) { return static_cast<int>(std::lround(value)); }

std::optional<VoxelImage> brain_of_labels(const CaseInputs& inputs) {
  if (!inputs.labels) return {};
  const bool aal = inputs.config.anatomy.numbers == LabelNumbers::kAal;
  VoxelImage map = aal ? anatomy::with_freesurfer_numbers_of_aal(*inputs.labels) : *inputs.labels;
  if (!aal && !inputs.label_names.empty()) {
    map = anatomy::with_freesurfer_numbers(map, inputs.label_names).value_or(std::move(map));
  }
  auto brain = anatomy::brain_from_labels(map);
  return brain ? std::optional(std::move(*brain)) : std::nullopt;
}

// The parts of a model that can be made although the whole cannot.
void take_parts(CaseView& view, CaseInputs inputs, const Progress& progress) {
  if (view.problems.front().starts_with("anatomy.labels")) {
    view.label_voxels = brain_of_labels(inputs);
  }
  if (auto tumour = anatomy::make_tumour_surface(inputs)) {
    view.tumour = std::move(*tumour);
  } else {
    if (const auto* label = std::get_if<TumourLabel>(&inputs.config.tumour);
        label != nullptr && inputs.tumour_labels) {
      view.tumour_voxels = mask_of(*inputs.tumour_labels, [label](float v) {
        return std::find(label->labels.begin(), label->labels.end(), label_of(v)) !=
               label->labels.end();
      });
    }
    // No finer edges about a tumour that is not there.
    if (auto* settings = std::get_if<MeshGeneration>(&inputs.config.mesh)) {
      settings->tumour_edge_mm = settings->edge_mm;
    }
  }
  const auto mesh = anatomy::make_brain_mesh(inputs, view.tumour, progress);
  if (!mesh) {
    if (inputs.brain) view.brain_voxels = mask_of(*inputs.brain, [](float v) { return v > 0.0F; });
    return;
  }
  const anatomy::BrainSurface brain = anatomy::brain_surface_of(*mesh);
  view.brain = brain.surface;
  view.nodes = mesh->num_nodes();
  view.tets = mesh->num_tets();
  const auto sets = anatomy::select_node_sets(brain, inputs.config);
  if (!sets) return;
  set_roles(view, brain.node_of_vertex, sets->craniotomy, sets->brainstem, sets->slaves);
  view.fluid_plane_depth_mm = sets->fluid_plane_depth_mm;
  view.slave_plane_depth_mm = sets->slave_plane_depth_mm;
}

Vec3 middle_of(const TriangleSurface& surface) {
  return 0.5 * (surface.vertices.rowwise().minCoeff() + surface.vertices.rowwise().maxCoeff());
}

Vec3 extent_of(const TriangleSurface& surface) {
  return surface.vertices.rowwise().maxCoeff() - surface.vertices.rowwise().minCoeff();
}

double distance_to_surface(const Vec3& x, const TriangleSurface& surface) {
  const auto index = geometry::ClosestPointIndex::build(surface);
  return index ? index->closest(x).distance_mm : 0.0;
}

double distance_to_vertices(const Vec3& x, const TriangleSurface& surface) {
  return (surface.vertices.colwise() - x).colwise().norm().minCoeff();
}

long count(const CaseView& view, NodeRole role) {
  return std::count(view.roles.begin(), view.roles.end(), role);
}

constexpr std::array<std::array<const char*, 2>, 3> kSides{
    {{"left", "right"}, {"posterior", "anterior"}, {"inferior", "superior"}}};
const char* side_of(int axis, double value) {
  return kSides[static_cast<std::size_t>(axis)][value < 0.0 ? 0 : 1];
}

double degrees_between(const Vec3& a, const Vec3& b) {
  const double cosine = a.normalized().dot(b.normalized());
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

}  // namespace

Result<CaseView> view_case(const std::filesystem::path& case_file, const Progress& progress) {
  auto config = io::read_case_config(case_file);
  if (!config) return tl::unexpected(config.error());
  const io::ReadableInputs read = io::load_readable_inputs(*config);
  const CaseInputs& inputs = read.inputs;
  CaseView view;
  view.config = *config;
  if (!config->mri.empty()) {
    auto mri = io::read_volume(config->mri);
    // That it is not there is among the inputs' errors.
    if (!mri && read.status) return tl::unexpected(mri.error());
    if (mri) view.background = std::move(*mri);
  }
  if (!view.background) view.background = inputs.brain;
  if (!read.status && !view.background && !inputs.mesh) return tl::unexpected(read.status.error());
  const auto model = read.status ? anatomy::build_brain_model(inputs, progress, &view.notes)
                                 : Result<BrainModel>(tl::unexpected(read.status.error()));
  if (model) {
    take_model(view, *model);
  } else {
    view.problems.push_back(model.error().message);
    take_parts(view, inputs, progress);
  }
  if (inputs.brain) {
    if (const auto mask = anatomy::brain_mask(*inputs.brain, {}, nullptr)) {
      const anatomy::MaskLeak leak = anatomy::mask_leak(*mask);
      view.leak_mm3 = leak.volume_mm3, view.leak_centre = leak.centre;
    }
  }
  if (view.brain.num_vertices() > 0) {
    view.projection_mm = distance_to_surface(config->craniotomy.centre_mm, view.brain);
  }
  return view;
}

Vec3 centre_of(const TriangleSurface& surface) {
  if (surface.num_vertices() == 0) return Vec3::Zero();
  return surface.vertices.rowwise().mean();
}

std::optional<Vec3> tumour_centre(const CaseView& view) {
  if (view.tumour.num_vertices() > 0) return centre_of(view.tumour);
  if (view.tumour_voxels) return geometry::mask_centre(*view.tumour_voxels).centre;
  return {};
}

std::optional<OpeningView> opening_of(const CaseView& view) {
  if (view.brain.num_vertices() == 0) return std::nullopt;
  const Points normals = geometry::vertex_normals(view.brain);
  if (view.roles.empty()) {
    Eigen::Index nearest = 0;
    const Craniotomy& craniotomy = view.config.craniotomy;
    const double distance =
        (view.brain.vertices.colwise() - craniotomy.centre_mm).colwise().norm().minCoeff(&nearest);
    if (distance > 0.5 * craniotomy.long_axis_mm) return std::nullopt;
    return OpeningView{view.brain.vertices.col(nearest), normals.col(nearest)};
  }
  OpeningView opening;
  for (std::size_t v = 0; v < view.roles.size(); ++v) {
    if (view.roles[v] != NodeRole::kCraniotomy) continue;
    opening.centre += view.brain.vertices.col(static_cast<Eigen::Index>(v));
    opening.normal += normals.col(static_cast<Eigen::Index>(v));
  }
  opening.centre /= static_cast<double>(count(view, NodeRole::kCraniotomy));
  opening.normal.normalize();
  return opening;
}

std::string place_text(const Vec3& x_ras) {
  return fmt::format("{} {:.0f}, {} {:.0f}, {} {:.0f} mm", side_of(0, x_ras[0]), std::abs(x_ras[0]),
                     side_of(1, x_ras[1]), std::abs(x_ras[1]), side_of(2, x_ras[2]),
                     std::abs(x_ras[2]));
}

std::string direction_text(const Vec3& direction) {
  const Vec3 unit = direction.normalized();
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(unit[a]) > std::abs(unit[b]); });
  std::string text;
  for (const int axis : order) {
    if (std::abs(unit[axis]) < 0.05) continue;
    text += fmt::format("{}{} {:.2f}", text.empty() ? "" : ", ", side_of(axis, unit[axis]),
                        std::abs(unit[axis]));
  }
  return text;
}

std::vector<std::string> facts(const CaseView& view) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("case {}", view.config.case_id));
  if (view.brain.num_vertices() > 0) {
    const Vec3 extent = extent_of(view.brain);
    lines.push_back(fmt::format(
        "brain: {:.0f} x {:.0f} x {:.0f} mm (R, A, S), {:.0f} cc; {} nodes, {} tetrahedra",
        extent[0], extent[1], extent[2], geometry::enclosed_volume(view.brain) / kMm3PerCc,
        view.nodes, view.tets));
  }
  if (view.tumour.num_vertices() > 0) {
    lines.push_back(fmt::format("tumour: {:.1f} cc at {}",
                                geometry::enclosed_volume(view.tumour) / kMm3PerCc,
                                place_text(centre_of(view.tumour))));
  }
  if (view.tumour_voxels) {
    lines.push_back(fmt::format("tumour: {:.2f} cc of voxels at {}; no surface can be made of them",
                                geometry::mask_centre(*view.tumour_voxels).volume_mm3 / kMm3PerCc,
                                place_text(*tumour_centre(view))));
  }
  if (view.brain_voxels) {
    lines.push_back(fmt::format("brain: {:.0f} cc of voxels; no mesh can be made of them",
                                geometry::mask_centre(*view.brain_voxels).volume_mm3 / kMm3PerCc));
  }
  if (view.septa.triangles.cols() > 0) {
    lines.push_back(fmt::format("falx and tentorium: {:.0f} cm2",
                                0.5 * geometry::area(view.septa) / kMm2PerCm2));
  }
  if (view.ventricles.triangles.cols() > 0) {
    lines.push_back(fmt::format("ventricles: {:.1f} cc",
                                -geometry::enclosed_volume(view.ventricles) / kMm3PerCc));
  }
  if (const auto opening = opening_of(view)) {
    lines.push_back(fmt::format(
        "craniotomy: at {}; it faces {}; craniotomy.centre_mm was projected by {:.1f} mm",
        place_text(opening->centre), direction_text(opening->normal), view.projection_mm));
    if (view.tumour.num_vertices() > 0) {
      lines.push_back(fmt::format("tumour's nearest point: {:.0f} mm from the craniotomy's centre",
                                  distance_to_vertices(opening->centre, view.tumour)));
    }
    lines.push_back(
        fmt::format("gravity: {}; {:.0f} degrees from the direction that the craniotomy faces",
                    direction_text(view.config.gravity_direction),
                    degrees_between(view.config.gravity_direction, opening->normal)));
  } else {
    lines.push_back("gravity: " + direction_text(view.config.gravity_direction));
  }
  if (!view.roles.empty()) {
    lines.push_back(
        fmt::format("surface nodes: {} craniotomy, {} may leave the skull, {} brainstem, {} fixed",
                    count(view, NodeRole::kCraniotomy), count(view, NodeRole::kSlave),
                    count(view, NodeRole::kBrainstem), count(view, NodeRole::kFixed)));
  }
  std::copy_if(view.notes.begin(), view.notes.end(), std::back_inserter(lines),
               anatomy::asks_nothing);
  return lines;
}

std::optional<MriFit> fit_of_mri(const CaseView& view) {
  if (view.config.mri.empty() || !view.background || view.brain.num_vertices() == 0) {
    return std::nullopt;
  }
  const geometry::Interpolator mri(*view.background);
  const Points normals = geometry::vertex_normals(view.brain);
  std::vector<double> below, above;
  for (Eigen::Index v = 0; v < normals.cols(); ++v) {
    const Vec3 x = view.brain.vertices.col(v), step = kAcross_mm * normals.col(v);
    below.push_back(mri(x - step)), above.push_back(mri(x + step));
  }
  const auto mean = [](const std::vector<double>& of) {
    return std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(of.size());
  };
  const double difference = mean(below) - mean(above);
  std::sort(below.begin(), below.end());
  const double median = below[below.size() / 2];
  if (!(median > 0.0)) return MriFit{0.0, 1.0};
  const auto lit = std::lower_bound(below.begin(), below.end(), kDark * median);
  return MriFit{difference / median,
                static_cast<double>(lit - below.begin()) / static_cast<double>(below.size())};
}

namespace {

void doubt_projection(const CaseView& view, std::vector<std::string>& lines) {
  if (view.projection_mm <= kFarProjection_mm) return;
  const Vec3& centre = view.config.craniotomy.centre_mm;
  const bool centimetres = distance_to_surface(10.0 * centre, view.brain) < kFarProjection_mm;
  lines.push_back(fmt::format(
      "craniotomy.centre_mm = [{:g}, {:g}, {:g}] is {:.0f} mm from the brain's surface, to which "
      "it "
      "is projected{}",
      centre[0], centre[1], centre[2], view.projection_mm,
      centimetres ? "; ten times as far out it lies on the surface: centimetres?" : ""));
}

void doubt_volume(const CaseView& view, std::vector<std::string>& lines) {
  const double cc = geometry::enclosed_volume(view.brain) / kMm3PerCc;
  if (cc >= kSmallBrain_cc && cc <= kLargeBrain_cc) return;
  lines.push_back(fmt::format("the brain has {:.0f} cc; an adult's has {:.0f} to {:.0f}: {}", cc,
                              kSmallBrain_cc, kLargeBrain_cc,
                              cc > kLargeBrain_cc
                                  ? "is images.brain skull-stripped, and without the face?"
                                  : "does images.brain hold the whole brain?"));
}

void doubt_mri(const CaseView& view, std::vector<std::string>& lines) {
  const auto fit = fit_of_mri(view);
  if (!fit || (fit->contrast >= kLeastContrast && fit->dark <= kLargestDark)) return;
  lines.push_back(fmt::format(
      "the brain's surface does not lie on the brain in images.mri: just inside the image is "
      "brighter than outside by {:.2f} of its median (a T1: about 0.5), and {:.0f} % of it is "
      "dark: are mask and MRI of one space?",
      fit->contrast, 100.0 * fit->dark));
}

void doubt_opening(const CaseView& view, const OpeningView& opening,
                   std::vector<std::string>& lines) {
  const double middle = middle_of(view.brain).x();
  if (view.tumour.num_vertices() > 0) {
    const double tumour = centre_of(view.tumour).x() - middle;
    const double open = opening.centre.x() - middle;
    if (tumour * open < 0.0 && std::min(std::abs(tumour), std::abs(open)) > kMiddle_mm) {
      lines.push_back(fmt::format(
          "the tumour lies on the {}, the craniotomy on the {}: is the side right in {} and "
          "craniotomy.centre_mm?",
          side_of(0, tumour), side_of(0, open), anatomy::tumour_key(view.config)));
    }
    const double distance = distance_to_vertices(opening.centre, view.tumour);
    if (distance > kFarOpening_mm) {
      lines.push_back(fmt::format(
          "the craniotomy's centre is {:.0f} mm from the tumour: look at craniotomy.centre_mm",
          distance));
    }
  }
  const double angle = degrees_between(view.config.gravity_direction, opening.normal);
  if (angle < 60.0) {
    lines.push_back(fmt::format(
        "the craniotomy faces down, {:.0f} degrees from gravity: look at gravity.direction, which "
        "points to where things fall",
        angle));
  }
}

}  // namespace

std::vector<std::string> doubts(const CaseView& view) {
  std::vector<std::string> lines;
  std::remove_copy_if(view.notes.begin(), view.notes.end(), std::back_inserter(lines),
                      anatomy::asks_nothing);
  if (view.brain.num_vertices() == 0) return lines;
  const double longest = extent_of(view.brain).maxCoeff();
  if (longest < kShortBrain_mm || longest > kLongBrain_mm) {
    lines.push_back(fmt::format(
        "the brain is {:.0f} mm long; an adult's is about 170: look at the units of its image or "
        "mesh",
        longest));
  }
  doubt_volume(view, lines);
  if (view.leak_mm3 > anatomy::kLeak_mm3) {
    lines.push_back(fmt::format(
        "{:.0f} cc of images.brain hang on the rest by a thin neck, at {}: did the mask leak into "
        "an orbit, the scalp or the skull, or is it the spinal cord?",
        view.leak_mm3 / kMm3PerCc, place_text(view.leak_centre)));
  }
  doubt_mri(view, lines);
  doubt_projection(view, lines);
  if (const auto opening = opening_of(view)) doubt_opening(view, *opening, lines);
  const Vec3& stem = view.config.brainstem.centre_mm;
  if (view.config.brainstem.radius_mm > 0.0 && stem.z() > middle_of(view.brain).z()) {
    lines.emplace_back("the brainstem lies above the brain's middle: look at brainstem.centre_mm");
  }
  const double share =
      geometry::enclosed_volume(view.tumour) / geometry::enclosed_volume(view.brain);
  if (share > kLargeTumour) {
    lines.push_back(fmt::format("the tumour takes {:.0f} % of the brain: look at {}", 100.0 * share,
                                anatomy::tumour_key(view.config)));
  }
  const auto slaves = static_cast<double>(count(view, NodeRole::kSlave));
  if (!view.roles.empty() && slaves < kFewSlaves * static_cast<double>(view.roles.size())) {
    lines.push_back(
        fmt::format("only {:.0f} surface nodes may leave the skull: look at gravity.direction and "
                    "contact.slave_depth_mm",
                    slaves));
  }
  return lines;
}

}  // namespace brainshift::client
