// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/brain_mesh.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/mesh_generation.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/misplacement.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::anatomy {
namespace {

// Gives 2,562 vertices on the ellipsoid of the default case; the paper's tumour had 2,541.
constexpr double kSurfaceEdge_mm = 1.05;
// Tetrahedra inside a tumour are not kept, so coarse ones are good enough.
constexpr double kInnerEdge_mm = 4.0;
// Width of the Gaussian that turns label voxels into a smooth surface, in mm and at least in
// voxels. A sphere of radius r shrinks by about sigma^2 / r: 0.07 mm at 14 mm.
constexpr double kLabelSmoothing_mm = 1.0;
constexpr double kLabelSmoothing_voxels = 0.7;

// A speck's worth of tumour, and more than a hemisphere.
constexpr double kSmallestTumour_mm = 2.0;
constexpr double kLargestTumour_mm = 200.0;

// Of a hollow tumour, enhancement round what is no tumour, twelve first points may be too few to
// begin with: 3 of 69 random rings, sheets and shells were left unmeshed, and with these none.
constexpr int kManyFirstPoints = 300;
// A ball of the smallest radius that has a surface keeps a quarter of its volume. What loses more
// was torn to pieces, of which the surface is one.
constexpr double kLeastKept = 0.25;

Result<TriangleSurface> surface_of_focus(const VoxelImage& mask, double sigma_mm) {
  const VoxelImage smooth = geometry::gaussian_smooth(mask, sigma_mm);
  const geometry::Interpolator value(smooth);
  const auto edge = [&value](const Vec3& x) {
    return value(x) > 0.6f ? kInnerEdge_mm : kSurfaceEdge_mm;
  };
  geometry::MeshingOptions options;
  options.sliver_bound_deg = 0.0;
  auto mesh = geometry::mesh_mask(smooth, edge, options);
  if (!mesh) {
    options.first_points = kManyFirstPoints;
    mesh = geometry::mesh_mask(smooth, edge, options);
  }
  return mesh.map([](const TetMesh& tets) { return geometry::boundary_surface(tets); });
}

// No voxel of the mask lies deeper than half of this below its surface, up to a voxel.
double thickness_mm(VoxelImage mask) {
  const double voxel = mask.T_ras_voxel.linear().colwise().norm().maxCoeff();
  int layers = 0;
  for (bool any = true; any;) {
    any = false;
    const VoxelImage before = mask;
    const auto inside = [&before](int i, int j, int k) {
      return i >= 0 && j >= 0 && k >= 0 && i < before.dims[0] && j < before.dims[1] &&
             k < before.dims[2] && before.at(i, j, k) >= 0.5F;
    };
    std::size_t v = 0;
    for (int k = 0; k < mask.dims[2]; ++k)
      for (int j = 0; j < mask.dims[1]; ++j)
        for (int i = 0; i < mask.dims[0]; ++i, ++v) {
          any = any || inside(i, j, k);
          const bool deep = inside(i, j, k) && inside(i - 1, j, k) && inside(i + 1, j, k) &&
                            inside(i, j - 1, k) && inside(i, j + 1, k) && inside(i, j, k - 1) &&
                            inside(i, j, k + 1);
          mask.values[v] = deep ? 1.0F : 0.0F;
        }
    layers += any ? 1 : 0;
  }
  return 2.0 * layers * voxel;
}

// What is wrong with a focus for which no surface, or one round `kept_mm3`, came out.
std::string too_thin(const Focus& focus, double sigma_mm, double kept_mm3) {
  return fmt::format(
      "a part of {:.2f} cc is too thin or too small for a surface: it is nowhere thicker than "
      "{:.1f} mm, and smoothing by {:.1f} mm (standard deviation) leaves {:.2f} cc in one piece",
      focus.volume_mm3 / 1000.0, thickness_mm(focus.mask), sigma_mm, kept_mm3 / 1000.0);
}

void append_surface(TriangleSurface& surface, const TriangleSurface& more) {
  const int vertices = surface.num_vertices();
  const Eigen::Index triangles = surface.triangles.cols();
  surface.vertices.conservativeResize(3, vertices + more.num_vertices());
  surface.vertices.rightCols(more.num_vertices()) = more.vertices;
  surface.triangles.conservativeResize(3, triangles + more.triangles.cols());
  surface.triangles.rightCols(more.triangles.cols()) = more.triangles.array() + vertices;
}

Result<TriangleSurface> surface_of_labels(const VoxelImage& image, const TumourLabel& tumour,
                                          Notes* notes) {
  const std::string what = fmt::format("tumour.label_volume.file = '{}'", tumour.path.string());
  const double voxel = std::cbrt(std::abs(image.T_ras_voxel.linear().determinant()));
  const double sigma = std::max(kLabelSmoothing_mm, kLabelSmoothing_voxels * voxel);
  const auto foci = tumour_foci(image, tumour.labels, 4.0 * sigma + 2.0 * voxel, what, notes);
  if (!foci) return tl::unexpected(foci.error());
  TriangleSurface surface;
  surface.vertices.resize(3, 0), surface.triangles.resize(3, 0);
  for (const Focus& focus : *foci) {
    const auto part = surface_of_focus(focus.mask, sigma);
    const double kept_mm3 = part ? geometry::enclosed_volume(*part) : 0.0;
    if (kept_mm3 >= kLeastKept * focus.volume_mm3) {
      append_surface(surface, *part);
      continue;
    }
    const std::string reason = what + ": " + too_thin(focus, sigma, kept_mm3);
    if (&focus == &foci->front()) return fail(ErrorCode::kEmptySet, reason);
    add_note(notes, reason + "; it is left out");
  }
  return surface;
}

}  // namespace

const char* tumour_key(const CaseConfig& config) {
  if (std::holds_alternative<TumourEllipsoid>(config.tumour)) return "tumour.ellipsoid";
  if (std::holds_alternative<TumourLabel>(config.tumour)) return "tumour.label_volume";
  return "tumour.surface";
}

Result<TriangleSurface> make_tumour_surface(const CaseInputs& inputs, Notes* notes) {
  if (const auto* ellipsoid = std::get_if<TumourEllipsoid>(&inputs.config.tumour))
    return geometry::ellipsoid_surface(ellipsoid->centre_mm, ellipsoid->semi_axes_mm,
                                       kSurfaceEdge_mm);
  if (const auto* label = std::get_if<TumourLabel>(&inputs.config.tumour)) {
    if (!inputs.tumour_labels) return invalid("tumour.label_volume.file: was not read");
    return surface_of_labels(*inputs.tumour_labels, *label, notes);
  }
  if (!inputs.tumour_surface) return invalid("tumour.surface.file: was not read");
  const std::string what =
      fmt::format("tumour.surface.file = '{}'",
                  std::get<TumourSurfaceFile>(inputs.config.tumour).path.string());
  auto surface = closed_surface(*inputs.tumour_surface, what, notes);
  if (!surface) return surface;
  const Vec3 size = surface->vertices.rowwise().maxCoeff() - surface->vertices.rowwise().minCoeff();
  const Status fits = check_extent(size, what + ":", kSmallestTumour_mm, kLargestTumour_mm);
  if (!fits) return tl::unexpected(fits.error());
  return surface;
}

Result<FittedTumour> fit_tumour(TriangleSurface tumour, const TetMesh& mesh,
                                const CaseConfig& config) {
  const geometry::TetLocator locator(mesh);
  const Points given = tumour.vertices;
  FittedTumour fitted{std::move(tumour), {}};
  int outside = 0;
  double farthest = 0.0;
  for (int v = 0; v < fitted.surface.num_vertices(); ++v) {
    const geometry::TetLocation place = locator.locate(fitted.surface.vertices.col(v));
    if (!(place.distance_mm > 0.0)) continue;
    ++outside;
    farthest = std::max(farthest, place.distance_mm);
    fitted.surface.vertices.col(v) = geometry::value_at(place, mesh.nodes);
  }
  if (outside == 0) return fitted;
  const std::string what =
      fmt::format("{}: {} of {} tumour surface points lie outside the brain, by up to {:.1f} mm",
                  tumour_key(config), outside, fitted.surface.num_vertices(), farthest);
  if (farthest > kLargestCut_mm) {
    const std::string mistake = geometry::likely_mistake(given, [&locator](const Points& meant) {
      return std::all_of(meant.colwise().begin(), meant.colwise().end(), [&](const auto& x) {
        return locator.locate(x).distance_mm <= kLargestCut_mm;
      });
    });
    return invalid(fmt::format("{}; at most {:g} mm are cut at the brain's surface{}", what,
                               kLargestCut_mm, mistake));
  }
  fitted.note = what + "; they were moved to its surface";
  return fitted;
}

namespace {

// A head is 150-200 mm; 20 admits small phantoms, 400 giants.
constexpr double kSmallestExtent_mm = 20.0;
constexpr double kLargestExtent_mm = 400.0;
// Growth of the edge per mm away from a refined zone. Delaunay refinement by itself grades like
// this.
constexpr double kGrading = 1.0 / 3.0;
constexpr int kRimSamples = 96;
// As far from the tangent plane as a craniotomy node may lie (brain_model_builder.cpp).
constexpr double kRimSearch_mm = 15.0;

Status check_brain_extent(const Vec3& size, const std::string& what) {
  return check_extent(size, what + ": brain", kSmallestExtent_mm, kLargestExtent_mm);
}

// Size of the box round the voxels > 0, in mm.
Vec3 mask_extent(const VoxelImage& mask) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  std::size_t v = 0;
  for (int k = 0; k < mask.dims[2]; ++k)
    for (int j = 0; j < mask.dims[1]; ++j)
      for (int i = 0; i < mask.dims[0]; ++i, ++v) {
        if (!(mask.values[v] > 0.0f)) continue;
        const Vec3 x = mask.T_ras_voxel * Vec3(i, j, k);
        low = low.cwiseMin(x);
        high = high.cwiseMax(x);
      }
  return high - low;
}

// The voxel centre of the domain's outermost layer that is nearest to a point.
Vec3 nearest_surface_voxel(const VoxelImage& mask, const Vec3& target) {
  Vec3 nearest = target;
  double best = std::numeric_limits<double>::infinity();
  const auto inside = [&mask](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < mask.dims[0] && j < mask.dims[1] && k < mask.dims[2] &&
           mask.at(i, j, k) >= 0.5f;
  };
  for (int k = 0; k < mask.dims[2]; ++k)
    for (int j = 0; j < mask.dims[1]; ++j)
      for (int i = 0; i < mask.dims[0]; ++i) {
        if (!inside(i, j, k)) continue;
        if (inside(i - 1, j, k) && inside(i + 1, j, k) && inside(i, j - 1, k) &&
            inside(i, j + 1, k) && inside(i, j, k - 1) && inside(i, j, k + 1))
          continue;
        const Vec3 x = mask.T_ras_voxel * Vec3(i, j, k);
        const double distance = (x - target).squaredNorm();
        if (distance < best) {
          best = distance;
          nearest = x;
        }
      }
  return nearest;
}

// First point of the domain on the line through `x` against `normal`, from kRimSearch_mm above x
// down to kRimSearch_mm below it. x itself when the line misses the domain.
Vec3 drop_to_surface(const geometry::Interpolator& value, const Vec3& x, const Vec3& normal) {
  for (double height = kRimSearch_mm; height > -kRimSearch_mm; height -= 0.5)
    if (value(x + height * normal) >= 0.5f) return x + height * normal;
  return x;
}

// Points on the rim of the craniotomy: its ellipse in the plane tangential to the mask's surface,
// dropped to that surface. This is accurate enough to refine the mesh; the node set is chosen
// later, on the mesh.
Points craniotomy_rim(const VoxelImage& smooth_mask, const Craniotomy& craniotomy) {
  const Vec3 centre = nearest_surface_voxel(smooth_mask, craniotomy.centre_mm);
  const geometry::Interpolator value(smooth_mask);
  Vec3 gradient;
  for (int a = 0; a < 3; ++a) {
    const Vec3 step = 2.0 * Vec3::Unit(a);
    gradient[a] = static_cast<double>(value(centre + step)) - value(centre - step);
  }
  const Vec3 normal = gradient.norm() > 0.0 ? Vec3(-gradient.normalized()) : Vec3(Vec3::UnitX());
  Vec3 along = craniotomy.long_axis_direction - normal * normal.dot(craniotomy.long_axis_direction);
  if (along.norm() < 1e-6) along = normal.unitOrthogonal();
  along.normalize();
  const Vec3 across = normal.cross(along);
  Points rim(3, kRimSamples);
  for (int i = 0; i < kRimSamples; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kRimSamples;
    const Vec3 x = centre + 0.5 * craniotomy.long_axis_mm * std::cos(angle) * along +
                   0.5 * craniotomy.short_axis_mm * std::sin(angle) * across;
    rim.col(i) = drop_to_surface(value, x, normal);
  }
  return rim;
}

// Edge at a distance from the middle of a zone of width `margin` in which `fine` holds.
double graded(double fine, double coarse, double distance, double margin) {
  return std::min(coarse, fine + kGrading * std::max(0.0, distance - margin));
}

// Distance to the tumour (mm), 0 inside. Beyond `reach` it is only a lower bound, the distance to
// the sphere round the tumour: most queries come from far away, where the exact value does not
// matter.
class TumourDistance {
 public:
  static Result<TumourDistance> build(const TriangleSurface& tumour, double reach) {
    auto index = geometry::ClosestPointIndex::build(tumour);
    if (!index) return tl::unexpected(index.error());
    return TumourDistance(std::move(*index), reach);
  }
  double operator()(const Vec3& x) const {
    const double to_sphere = (x - centre_).norm() - radius_;
    if (to_sphere > reach_) return to_sphere;
    return to_sphere < 0.0 && index_->contains(x) ? 0.0 : index_->closest(x).distance_mm;
  }

 private:
  TumourDistance(geometry::ClosestPointIndex index, double reach)
      : index_(std::make_shared<geometry::ClosestPointIndex>(std::move(index))), reach_(reach) {
    const Points& vertices = index_->surface().vertices;
    centre_ = vertices.rowwise().mean();
    radius_ = (vertices.colwise() - centre_).colwise().norm().maxCoeff();
  }
  std::shared_ptr<const geometry::ClosestPointIndex> index_;  // a std::function must be copyable
  double reach_;
  Vec3 centre_;
  double radius_ = 0.0;
};

Result<geometry::SizingField> sizing_field(const MeshGeneration& settings,
                                           const Craniotomy& craniotomy,
                                           const VoxelImage& smooth_mask,
                                           const TriangleSurface& tumour) {
  std::optional<TumourDistance> to_tumour;
  if (settings.tumour_edge_mm < settings.edge_mm) {
    const double reach =
        settings.tumour_margin_mm + (settings.edge_mm - settings.tumour_edge_mm) / kGrading;
    auto distance = TumourDistance::build(tumour, reach);
    if (!distance) return tl::unexpected(distance.error());
    to_tumour = std::move(*distance);
  }
  Points rim(3, 0);
  if (settings.craniotomy_edge_mm < settings.edge_mm) rim = craniotomy_rim(smooth_mask, craniotomy);
  return geometry::SizingField([settings, to_tumour, rim](const Vec3& x) {
    double edge = settings.edge_mm;
    if (to_tumour)
      edge = std::min(edge, graded(settings.tumour_edge_mm, settings.edge_mm, (*to_tumour)(x),
                                   settings.tumour_margin_mm));
    if (rim.cols() > 0) {
      const double distance = std::sqrt((rim.colwise() - x).colwise().squaredNorm().minCoeff());
      edge = std::min(edge, graded(settings.craniotomy_edge_mm, settings.edge_mm, distance,
                                   settings.craniotomy_margin_mm));
    }
    return edge;
  });
}

// Only falx, tentorium and the walls of ventricles need to be smooth.
bool loose(int a, int b) {
  return septum_between(a, b) == Septum::kNone && a != kVentricleRegion && b != kVentricleRegion;
}

Result<TetMesh> generate(const CaseInputs& inputs, const MeshGeneration& settings,
                         const TriangleSurface& tumour, const Progress& progress, Notes* notes,
                         const Regions* regions) {
  const std::string file = fmt::format("images.brain = '{}'", inputs.config.brain.string());
  if (!inputs.brain) return invalid(file + ": was not read");
  report(progress, "mask", 0.0);
  auto component = brain_mask(*inputs.brain, file, notes);
  if (!component) return tl::unexpected(component.error());
  if (Status status = check_brain_extent(mask_extent(*component), file); !status)
    return tl::unexpected(status.error());
  const VoxelImage smooth = geometry::gaussian_smooth(
      without_sulci(std::move(*component), file, notes), settings.smoothing_mm);
  const auto edge_mm = sizing_field(settings, inputs.config.craniotomy, smooth, tumour);
  if (!edge_mm) return tl::unexpected(edge_mm.error());
  auto mesh = regions == nullptr ? geometry::mesh_mask(smooth, *edge_mm, {}, progress)
                                 : geometry::mesh_regions(
                                       smooth, [regions](const Vec3& x) { return regions->at(x); },
                                       loose, *edge_mm, {}, progress);
  if (!mesh) return fail(mesh.error().code, fmt::format("{}: {}", file, mesh.error().message));
  return mesh;
}

}  // namespace

Result<TetMesh> make_brain_mesh(const CaseInputs& inputs, const TriangleSurface& tumour,
                                const Progress& progress, Notes* notes, const Regions* regions) {
  if (const auto* settings = std::get_if<MeshGeneration>(&inputs.config.mesh))
    return generate(inputs, *settings, tumour, progress, notes, regions);
  const std::string file =
      fmt::format("mesh.file = '{}'", std::get<MeshFile>(inputs.config.mesh).path.string());
  if (!inputs.mesh) return invalid(file + ": was not read");
  report(progress, "check mesh", 0.0);
  if (Status status = geometry::check_mesh(*inputs.mesh); !status)
    return fail(status.error().code, fmt::format("{}: {}", file, status.error().message));
  const Vec3 size =
      inputs.mesh->nodes.rowwise().maxCoeff() - inputs.mesh->nodes.rowwise().minCoeff();
  if (Status status = check_brain_extent(size, file); !status)
    return tl::unexpected(status.error());
  return *inputs.mesh;
}

}  // namespace brainshift::anatomy
