// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/brain_model_builder.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "common/anatomy/brain_mesh.hpp"
#include "common/anatomy/node_sets.hpp"
#include "common/anatomy/tumour_surface.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/surface.hpp"
#include "common/values/model_id.hpp"

namespace brainshift::anatomy {
namespace {

// Turns a given skull so that its normals agree with the brain's. The skull may be open (with its
// craniotomy), so the sign of its volume cannot decide; the brain beneath it can.
Result<TriangleSurface> oriented_skull(TriangleSurface skull, const BrainSurface& brain,
                                       const std::string& file) {
  const auto index = geometry::ClosestPointIndex::build(skull);
  if (!index)
    return fail(index.error().code,
                fmt::format("contact.skull_file = '{}': {}", file, index.error().message));
  double agreement = 0.0;
  for (int v = 0; v < brain.surface.num_vertices(); ++v) {
    const auto nearest = index->closest(brain.surface.vertices.col(v));
    agreement += index->triangle_normal(nearest.triangle).dot(brain.normals.col(v));
  }
  if (agreement < 0.0) skull.triangles.row(1).swap(skull.triangles.row(2));
  return skull;
}

// The patient's own inner skull surface, or the brain's surface moved outwards by the gap.
Result<TriangleSurface> make_skull(const CaseInputs& inputs, const BrainSurface& brain) {
  const ContactConfig& contact = inputs.config.contact;
  if (!contact.skull_file) return geometry::offset_surface(brain.surface, contact.gap_mm);
  if (!inputs.skull)
    return fail(ErrorCode::kInvalidArgument, fmt::format("contact.skull_file = '{}': was not read",
                                                         contact.skull_file->string()));
  return oriented_skull(*inputs.skull, brain, contact.skull_file->string());
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

}  // namespace

Result<BrainModel> build_brain_model(const CaseInputs& inputs, const Progress& progress,
                                     std::vector<std::string>* notes) {
  const CaseConfig& config = inputs.config;
  if (Status status = validate(config); !status) return tl::unexpected(status.error());

  report(progress, "tumour surface", 0.0);
  auto tumour = make_tumour_surface(inputs);
  if (!tumour) return tl::unexpected(tumour.error());

  auto mesh = make_brain_mesh(inputs, *tumour, progress);
  if (!mesh) return tl::unexpected(mesh.error());
  auto fitted = fit_tumour(std::move(*tumour), *mesh, config);
  if (!fitted) return tl::unexpected(fitted.error());
  if (notes != nullptr && !fitted->note.empty()) notes->push_back(fitted->note);

  report(progress, "node sets", 0.0);
  const BrainSurface brain = brain_surface_of(*mesh);
  auto sets = select_node_sets(brain, config);
  if (!sets) return tl::unexpected(sets.error());
  auto skull = make_skull(inputs, brain);
  if (!skull) return tl::unexpected(skull.error());

  report(progress, "tumour distances", 0.0);
  auto distances = tumour_distances(fitted->surface);
  if (!distances) return fail(distances.error().code, "tumour: " + distances.error().message);

  BrainModel model;
  model.case_id = config.case_id;
  model.boundary_triangles = geometry::boundary_triangles(*mesh);
  model.mesh = std::move(*mesh);
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
