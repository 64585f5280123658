// SPDX-License-Identifier: Apache-2.0
#include "brainshift/v1/brainshift.pb.h"
#include "common/core/text.hpp"
#include "common/wire/checked_values.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/payload_scan.hpp"

namespace brainshift::wire {

std::string encode(const BrainModel& model) {
  pb::ModelReply message;
  message.set_case_id(to_utf8(model.case_id));
  message.set_model_id(to_utf8(model.model_id));
  set(model.mesh.nodes, message.mutable_nodes());
  set<4>(model.mesh.tets, message.mutable_tet_indices());
  set(model.mesh.labels, message.mutable_tet_labels());
  set<3>(model.boundary_triangles, message.mutable_boundary_indices());
  set<3>(model.septa.triangles, message.mutable_septa_indices());
  set<3>(model.ventricle_wall, message.mutable_ventricle_indices());
  set(model.skull, message.mutable_skull());
  set(model.tumour, message.mutable_tumour());
  set(model.craniotomy, message.mutable_craniotomy());
  set(model.brainstem, message.mutable_brainstem());
  set(model.slaves, message.mutable_slaves());
  set(model.fixed, message.mutable_fixed());
  set(model.gravity_direction, message.mutable_gravity_direction());
  message.set_fluid_plane_depth_mm(model.fluid_plane_depth_mm);
  message.set_slave_plane_depth_mm(model.slave_plane_depth_mm);
  return message.SerializeAsString();
}

Result<BrainModel> decode_model(std::string_view payload) {
  pb::ModelReply message;
  if (Status status = parse(payload, message); !status) return tl::unexpected(status.error());
  Checked checked;
  BrainModel model;
  model.case_id = message.case_id();
  model.model_id = message.model_id();
  model.mesh.nodes = checked.points(message.nodes(), "model.nodes");
  const int nodes = model.mesh.num_nodes();
  model.mesh.tets = checked.index_columns<4>(message.tet_indices(), nodes, "model.tet_indices");
  model.mesh.labels.assign(message.tet_labels().begin(), message.tet_labels().end());
  checked.require(model.mesh.labels.empty() ||
                      static_cast<Eigen::Index>(model.mesh.labels.size()) == model.mesh.tets.cols(),
                  "model.tet_labels",
                  std::to_string(model.mesh.labels.size()) +
                      " labels, must be 0 or one per tetrahedron (" +
                      std::to_string(model.mesh.tets.cols()) + ")");
  model.boundary_triangles =
      checked.index_columns<3>(message.boundary_indices(), nodes, "model.boundary_indices");
  model.septa.triangles =
      checked.index_columns<3>(message.septa_indices(), nodes, "model.septa_indices");
  model.ventricle_wall =
      checked.index_columns<3>(message.ventricle_indices(), nodes, "model.ventricle_indices");
  model.skull = checked.surface(message.skull(), "model.skull");
  model.tumour = checked.surface(message.tumour(), "model.tumour");
  model.craniotomy = checked.indices(message.craniotomy(), nodes, "model.craniotomy");
  model.brainstem = checked.indices(message.brainstem(), nodes, "model.brainstem");
  model.slaves = checked.indices(message.slaves(), nodes, "model.slaves");
  model.fixed = checked.indices(message.fixed(), nodes, "model.fixed");
  model.gravity_direction =
      checked.unit_vector(message.gravity_direction(), "model.gravity_direction");
  model.fluid_plane_depth_mm =
      checked.number(message.fluid_plane_depth_mm(), "model.fluid_plane_depth_mm");
  model.slave_plane_depth_mm =
      checked.number(message.slave_plane_depth_mm(), "model.slave_plane_depth_mm");
  if (!checked.ok()) return tl::unexpected(checked.status().error());
  return model;
}

}  // namespace brainshift::wire
