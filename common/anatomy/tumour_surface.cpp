// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/tumour_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/geometry/mask.hpp"
#include "common/geometry/mesh_generation.hpp"
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

Result<TriangleSurface> surface_of_label(const VoxelImage& image, int label,
                                         const std::string& file) {
  VoxelImage mask = image;
  std::transform(mask.values.begin(), mask.values.end(), mask.values.begin(), [label](float v) {
    return std::abs(static_cast<double>(v) - label) < 0.5 ? 1.0f : 0.0f;
  });
  const auto component = geometry::largest_component(mask);
  if (!component)
    return fail(ErrorCode::kEmptySet,
                fmt::format("tumour.label_volume.label = {}: no voxel of '{}' has this label",
                            label, file));
  const double voxel = std::cbrt(std::abs(image.T_ras_voxel.linear().determinant()));
  const double sigma = std::max(kLabelSmoothing_mm, kLabelSmoothing_voxels * voxel);
  const VoxelImage smooth = geometry::gaussian_smooth(*component, sigma);
  const geometry::Interpolator value(smooth);
  const auto edge = [&value](const Vec3& x) {
    return value(x) > 0.6f ? kInnerEdge_mm : kSurfaceEdge_mm;
  };
  geometry::MeshingOptions options;
  options.sliver_bound_deg = 0.0;
  const auto mesh = geometry::mesh_mask(smooth, edge, options);
  if (!mesh)
    return fail(mesh.error().code,
                fmt::format("tumour.label_volume.label = {}: too small for a surface: {}", label,
                            mesh.error().message));
  return geometry::boundary_surface(*mesh);
}

Result<TriangleSurface> checked_surface(TriangleSurface surface, const std::string& file) {
  const auto refuse = [&file](ErrorCode code, const std::string& reason) {
    return fail(code, fmt::format("tumour.surface.file = '{}': {}", file, reason));
  };
  if (surface.num_triangles() == 0) return refuse(ErrorCode::kEmptySet, "has no triangle");
  if (!surface.vertices.allFinite())
    return refuse(ErrorCode::kNotFinite, "has a vertex that is not finite");
  if (surface.triangles.minCoeff() < 0 || surface.triangles.maxCoeff() >= surface.num_vertices())
    return refuse(ErrorCode::kInvalidArgument, "a triangle names a vertex that does not exist");
  if (!geometry::is_closed(surface))
    return refuse(ErrorCode::kInvalidArgument, "must be a closed surface");
  if (geometry::enclosed_volume(surface) < 0.0)
    surface.triangles.row(1).swap(surface.triangles.row(2));
  return surface;
}

}  // namespace

const char* tumour_key(const CaseConfig& config) {
  if (std::holds_alternative<TumourEllipsoid>(config.tumour)) return "tumour.ellipsoid";
  if (std::holds_alternative<TumourLabel>(config.tumour)) return "tumour.label_volume";
  return "tumour.surface";
}

Result<TriangleSurface> make_tumour_surface(const CaseInputs& inputs) {
  if (const auto* ellipsoid = std::get_if<TumourEllipsoid>(&inputs.config.tumour))
    return geometry::ellipsoid_surface(ellipsoid->centre_mm, ellipsoid->semi_axes_mm,
                                       kSurfaceEdge_mm);
  if (const auto* label = std::get_if<TumourLabel>(&inputs.config.tumour)) {
    if (!inputs.tumour_labels)
      return fail(ErrorCode::kInvalidArgument, "tumour.label_volume.file: was not read");
    return surface_of_label(*inputs.tumour_labels, label->label, label->path.string());
  }
  if (!inputs.tumour_surface)
    return fail(ErrorCode::kInvalidArgument, "tumour.surface.file: was not read");
  return checked_surface(*inputs.tumour_surface,
                         std::get<TumourSurfaceFile>(inputs.config.tumour).path.string());
}

Result<FittedTumour> fit_tumour(TriangleSurface tumour, const TetMesh& mesh,
                                const CaseConfig& config) {
  const geometry::TetLocator locator(mesh);
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
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{}; at most {:g} mm are cut at the brain's surface", what, kLargestCut_mm));
  }
  fitted.note = what + "; they were moved to its surface";
  return fitted;
}

}  // namespace brainshift::anatomy
