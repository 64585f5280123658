// SPDX-License-Identifier: GPL-3.0-or-later
// The brain that a surgery really has: stiffness that varies, a part of the tumour gone, another
// contact with the skull, another mesh. No estimate knows it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "client/tools/twin/other_mesh.hpp"
#include "client/tools/twin/scenario.hpp"
#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

struct TruthBrain {
  BrainModel model;   // that of the case but for the labels of the mesh
  CaseConfig config;  // that of the case but for the material and the contact's penalty
  TetMesh tissue;     // what has weight and swells: all nodes, the tetrahedra of tissue
  // The tumour's surface vertices as points of the mesh, and which of them an instrument can see.
  std::vector<io::ScorePoint> tumour;
  std::vector<int> seen;           // indices into `tumour`, ascending; all but for a resection
  std::vector<NodeIndex> removed;  // nodes inside a cavity, ascending
  // Where the tumour's outline really is before surgery: `tumour`'s places, but for errors of
  // segmentation.
  Points outline;
  // Absent: the truth is solved for on the case's own mesh. Its labels are those of `config`.
  std::shared_ptr<const OtherMesh> elsewhere;
  std::optional<std::uint64_t> gap_seed;  // Adversity::gap_seed
};

// The stiffness of the scenario and the seed, then the resection. other: the head meshed anew, for
// a scenario with Adversity::other_mesh; without it mesh_anew() makes it. Errors as resect() and
// make_other_mesh(); kEmptySet when nothing of the tumour's surface is left to see.
Result<TruthBrain> truth_brain(const BrainModel& model, const CaseConfig& config,
                               const Scenario& scenario, std::uint64_t seed,
                               const BrainModel* other = nullptr);

}  // namespace brainshift::client
