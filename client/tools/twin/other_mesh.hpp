// SPDX-License-Identifier: GPL-3.0-or-later
// The same head in another mesh, with quadratic elements: where a truth comes from that shares
// neither mesh nor element with the estimate.
//
// Its edges are kOtherEdge times as long, but for those near the craniotomy's rim, which a camera
// sees. A quadratic tetrahedron has a node in the middle of every edge. So this mesh has between
// two and three times as many unknowns as the case's, and an error of displacement that falls with
// the third power of the edge instead of the second.
#pragma once

#include <memory>

#include "client/tools/twin/space_points.hpp"
#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

inline constexpr double kOtherEdge = 1.4;

// The case built again with these edges: mesh, node sets and skull of its own. kInvalidArgument
// when the case names a ready mesh. Otherwise errors of patient::build_patient.
Result<BrainModel> mesh_anew(const CaseConfig& config, const Progress& progress = {});

struct OtherMesh {
  BrainModel model;              // of the other mesh
  fem::DisplacementSpace space;  // quadratic, on its mesh
  geometry::TetLocator locator;  // of its mesh
  SpacePoints nodes, tumour;     // nodes and tumour's vertices of the case's model
};

// model: of the case. other: of the same head; its tumour is not looked at. kInvalidArgument when
// the meshes are more than kLargestMismatch_mm apart somewhere: not the same head.
inline constexpr double kLargestMismatch_mm = 5.0;
Result<std::shared_ptr<const OtherMesh>> make_other_mesh(const BrainModel& model, BrainModel other);

}  // namespace brainshift::client
