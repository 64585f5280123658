// SPDX-License-Identifier: GPL-3.0-or-later
// One way to estimate the surgeries of a patient: the case with a change, a boundary condition, and
// which observations it has. `make evidence` plays two (contact, fixed), `make ablations` many
// (tests/ablations/parts.hpp).
#pragma once

#include <functional>
#include <string>

#include "common/configuration/case_config.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"

namespace brainshift::evidence {

// What must be made anew for it, besides the inverter.
enum class Anew {
  kNothing,    // the change is of what an update reads: sensing, prior.scales
  kOperators,  // factor, prior and condensed operators
  kMesh,       // these and the mesh, so that the surgeries are played anew, on it
};

struct Variant {
  std::string name;
  Anew anew = Anew::kNothing;
  Boundary boundary = Boundary::kContact;
  std::function<void(CaseConfig&)> change = {};           // none: the case as it is
  std::function<bool(const Observation&)> has_seen = {};  // none: every observation
};

}  // namespace brainshift::evidence
