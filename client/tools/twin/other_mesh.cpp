// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/other_mesh.hpp"

#include <fmt/format.h>

#include <utility>

#include "common/patient/read_patient.hpp"

namespace brainshift::client {

Result<BrainModel> mesh_anew(const CaseConfig& config, const Progress& progress) {
  CaseConfig other = config;
  auto* mesh = std::get_if<MeshGeneration>(&other.mesh);
  if (mesh == nullptr) {
    return fail(ErrorCode::kInvalidArgument,
                "case " + config.case_id +
                    ": mesh.file: adverse ingredient mesh needs a case whose mesh is generated");
  }
  mesh->edge_mm *= kOtherEdge;
  mesh->tumour_edge_mm *= kOtherEdge;
  return patient::build_patient(other, progress);
}

Result<std::shared_ptr<const OtherMesh>> make_other_mesh(const BrainModel& model,
                                                         BrainModel other) {
  geometry::TetLocator locator(other.mesh);
  SpacePoints nodes(locator, model.mesh.nodes);
  SpacePoints tumour(locator, model.tumour.vertices);
  if (nodes.farthest_outside_mm() > kLargestMismatch_mm) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("the other mesh leaves out a node of the case's mesh by {:.1f} mm: not "
                            "the same head",
                            nodes.farthest_outside_mm()));
  }
  fem::DisplacementSpace space = fem::make_space(other.mesh, fem::Element::kP2);
  return std::make_shared<const OtherMesh>(OtherMesh{
      std::move(other), std::move(space), std::move(locator), std::move(nodes), std::move(tumour)});
}

}  // namespace brainshift::client
