// SPDX-License-Identifier: GPL-3.0-or-later
// What pulls and pushes a TruthBrain, as forces on the nodes of the body that is solved for, and
// what its displacement is at the places of the case's model. And whether all of it does anything.
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

// A scenario or an adverse ingredient that does nothing on a case is an error: its figures would
// say that it does no harm.
//
// Gravity below this angle beside its known direction counts as unturned.
inline constexpr double kMinTilt_deg = 1.0;

// Before a surgery. kInvalidArgument: a tilt about an axis that gravity lies along; a fluid level
// or a direction of gravity that changes no weight, because no tissue lies between the planes or
// none is out of the fluid.
Status check_gravity(const TruthBrain& brain, const Scenario& scenario);

// Before a surgery. kInvalidArgument: a spatula that touches no exposed node, or without pressure.
Status check_retraction(const TruthBrain& brain, const Scenario& scenario);

// True when an ingredient changes the contact with the skull.
bool depends_on_contact(const Scenario& scenario);
// Whether contact matters to a surgery's truths.
class ContactSeen {
 public:
  // A moment: slaves in contact, and the displacement at the nodes of the case's model.
  void add(const BrainModel& model, int active, const Points& displacement);
  bool active() const { return active_; }
  // In contact, or it would be with the case's own skull.
  bool either() const { return active_ || with_the_case_; }

 private:
  bool active_ = false, with_the_case_ = false;
};

// After a surgery. kInvalidArgument: another penalty or gap where no slave touches.
Status check_contact(const Scenario& scenario, const ContactSeen& seen);

}  // namespace brainshift::client
