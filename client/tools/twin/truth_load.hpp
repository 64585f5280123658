// SPDX-License-Identifier: GPL-3.0-or-later
// What pulls and pushes a TruthBrain, as forces on the nodes of the body that is solved for, and
// what its displacement is at the places of the case's model.
#pragma once

#include "client/tools/twin/truth_brain.hpp"

namespace brainshift::client {

// The case's gravity, turned as the scenario says, and the depth of the fluid plane perpendicular
// to it through the lowest craniotomy node of the case's model.
struct Gravity {
  Vec3 direction;
  double fluid_plane_depth_mm = 0.0;
};
Gravity gravity_of(const BrainModel& model, const Scenario& scenario);
// The case's gravity after Scenario::gravity_tilt_deg alone.
Vec3 tilted_gravity(const BrainModel& model, double tilt_deg);

// Nodal forces, N, 3 x nodes of the case's mesh or of brain.elsewhere's space. Weight and buoyancy
// with the fluid at this level, mm below gravity's plane; swelling, volume change and spatula.
Points gravity_load(const TruthBrain& brain, const Gravity& gravity, double fluid_level_mm);
Points constant_load(const TruthBrain& brain, const Scenario& scenario);

// u: 3 x the same nodes, mm. At the nodes of the case's mesh, and at the tumour's vertices.
Points displacement_at_nodes(const TruthBrain& brain, const Points& u);
Points displacement_of_tumour(const TruthBrain& brain, const Points& u);

}  // namespace brainshift::client
