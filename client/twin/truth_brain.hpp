// SPDX-License-Identifier: GPL-3.0-or-later
// The brain that a surgery really has: stiffness that varies, a part of the tumour gone. No
// estimate knows it.
#pragma once

#include <cstdint>
#include <vector>

#include "client/twin/scenario.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"

namespace brainshift::client {

struct TruthBrain {
  BrainModel model;   // that of the case but for the labels of the mesh
  CaseConfig config;  // that of the case but for the material
  TetMesh tissue;     // what has weight and swells: all nodes, the tetrahedra of tissue
  // The tumour's surface vertices as points of the mesh, and which of them an instrument can see.
  std::vector<io::ScorePoint> tumour;
  std::vector<int> seen;           // indices into `tumour`, ascending; all but for a resection
  std::vector<NodeIndex> removed;  // nodes inside a cavity, ascending
};

// True when the scenario leaves the brain as the case describes it.
bool keeps_the_brain(const Scenario& scenario);

// The stiffness of the scenario and the seed, then the resection. Errors as resect(); kEmptySet
// when nothing of the tumour's surface is left to see.
Result<TruthBrain> truth_brain(const BrainModel& model, const CaseConfig& config,
                               const Scenario& scenario, std::uint64_t seed);

}  // namespace brainshift::client
