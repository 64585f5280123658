// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/other_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/tools/twin/sheets.hpp"
#include "common/fem/space_elasticity.hpp"
#include "common/geometry/surface.hpp"
#include "common/patient/read_patient.hpp"

namespace brainshift::client {

SpacePoints::SpacePoints(const geometry::TetLocator& locator, const Points& points) {
  places_.reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const geometry::TetLocation found = locator.locate(points.col(i));
    farthest_mm_ = std::max(farthest_mm_, found.distance_mm);
    Place place{found.tet, Eigen::Vector4d::Zero()};
    for (int k = 0; k < 4; ++k) {  // a location outside lists the vertices in another order
      for (int j = 0; j < 4; ++j) {
        if (found.nodes[j] == locator.tets()(k, found.tet)) place.l[k] = found.weights[j];
      }
    }
    places_.push_back(place);
  }
}

Points SpacePoints::displacement(const fem::DisplacementSpace& space, const Points& u) const {
  Points values(3, static_cast<Eigen::Index>(places_.size()));
  for (std::size_t i = 0; i < places_.size(); ++i) {
    values.col(static_cast<Eigen::Index>(i)) =
        fem::displacement_at(space, u, places_[i].element, places_[i].l);
  }
  return values;
}

Result<BrainModel> mesh_anew(const CaseConfig& config, const Progress& progress) {
  CaseConfig other = config;
  auto* mesh = std::get_if<MeshGeneration>(&other.mesh);
  if (mesh == nullptr) {
    return invalid("case " + config.case_id +
                   ": mesh.file: adverse ingredient mesh needs a case whose mesh is generated");
  }
  mesh->edge_mm *= kOtherEdge;
  mesh->tumour_edge_mm *= kOtherEdge;
  return patient::build_patient(other, progress);
}

SpacePoints nodes_elsewhere(const BrainModel& model, const BrainModel& other,
                            const geometry::TetLocator& locator) {
  const bool sheets = other.septa.triangles.cols() > 0;
  return SpacePoints(locator, sheets ? nodes_in_their_sides(model) : model.mesh.nodes);
}

Result<std::shared_ptr<const OtherMesh>> make_other_mesh(const BrainModel& model,
                                                         BrainModel other) {
  geometry::TetLocator locator(other.mesh);
  SpacePoints nodes = nodes_elsewhere(model, other, locator);
  SpacePoints tumour(locator, model.tumour.vertices);
  const SpacePoints surface(
      locator, geometry::surface_of(model.mesh.nodes, model.boundary_triangles).vertices);
  if (surface.farthest_outside_mm() > kLargestMismatch_mm) {
    return invalid(fmt::format(
        "the other mesh leaves out a node of the case's mesh by {:.1f} mm: not the same head",
        surface.farthest_outside_mm()));
  }
  fem::DisplacementSpace space = fem::make_space(other.mesh, fem::Element::kP2);
  return std::make_shared<const OtherMesh>(OtherMesh{
      std::move(other), std::move(space), std::move(locator), std::move(nodes), std::move(tumour)});
}

}  // namespace brainshift::client
