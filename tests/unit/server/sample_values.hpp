// SPDX-License-Identifier: GPL-3.0-or-later
// Small values that the server's tests share.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/values/brain_model.hpp"
#include "common/values/observation.hpp"

namespace brainshift::server {

inline constexpr const char* kCase = "test-case";
inline constexpr const char* kModelId = "0123456789abcdef";
inline constexpr std::uint64_t kBootId = 0xb007;

// Four landmark pairs, each moved by `shift_mm` along x, for the first session.
inline Observation landmarks(std::uint64_t sequence, const std::string& source = "pointer",
                             double shift_mm = 1.0) {
  LandmarkPairs pairs;
  pairs.undeformed.resize(3, 4);
  pairs.undeformed << 0, 10, 0, 0,  //
      0, 0, 10, 0,                  //
      0, 0, 0, 10;
  pairs.deformed = pairs.undeformed.colwise() + Vec3(shift_mm, 0, 0);
  pairs.sd_mm = 0.3;
  Observation observation;
  observation.case_id = kCase;
  observation.source = source;
  observation.sequence = sequence;
  observation.session = {kBootId, 1, kModelId};
  observation.body = pairs;
  return observation;
}

// The same for another session of the daemon.
inline Observation in_session(std::uint64_t session_id, Observation observation) {
  observation.session.session_id = session_id;
  return observation;
}

// One tetrahedron that is brain and tumour: enough to register to.
inline std::shared_ptr<const BrainModel> small_model() {
  auto model = std::make_shared<BrainModel>();
  model->case_id = kCase;
  model->model_id = kModelId;
  model->mesh.nodes.resize(3, 4);
  model->mesh.nodes << 0, 1, 0, 0,  //
      0, 0, 1, 0,                   //
      0, 0, 0, 1;
  model->mesh.tets.resize(4, 1);
  model->mesh.tets << 0, 1, 2, 3;
  model->tumour.vertices = model->mesh.nodes;
  model->tumour.triangles.resize(3, 4);
  model->tumour.triangles << 0, 0, 0, 1,  //
      2, 1, 3, 2,                         //
      1, 3, 2, 3;
  return model;
}

}  // namespace brainshift::server
