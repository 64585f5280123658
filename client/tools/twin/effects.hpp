// SPDX-License-Identifier: GPL-3.0-or-later
// A scenario or an adverse ingredient that does nothing on a case is an error: its figures would
// say that it does no harm.
#pragma once

#include "client/tools/twin/truth_brain.hpp"

namespace brainshift::client {

// Gravity below this angle beside its known direction counts as unturned.
inline constexpr double kLeastTilt_deg = 1.0;

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
