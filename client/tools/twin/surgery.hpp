// SPDX-License-Identifier: GPL-3.0-or-later
// A scenario played on one patient: what is measured at each moment, and the truth behind it.
#pragma once

#include <cstdint>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "client/tools/twin/truth.hpp"
#include "client/tools/twin/truth_brain.hpp"
#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

// One entry per observation in both lists: moment after moment, every
// instrument of a moment with the same truth.
struct SimulatedSurgery {
  std::vector<Observation> observations;  // sequences from 1, acquired_ns from 0
  std::vector<io::SurgeryTruth> truths;
};

// Plays the scenario. Everything random comes from the seed.
// Truth scalars: fluid_level_mm, noise_sd_mm, max_displacement_mm,
// tumour_displacement_mm (mean over the tumour's surface), active_slaves,
// max_penetration_mm (negative: minus the least distance between slave and
// skull); with a swelling also swelling_volume_strain and swelling_radius_mm; with a volume change
// brain_volume_strain; with a resection resected_fraction and removed_nodes.
// Points where truth is scored: sparse and cross, which part the tumour's surface as far as an
// instrument sees it, craniotomy, and removed: nodes inside a cavity, where nothing is scored.
//
// kInvalidArgument when a scenario that promises no contact has some; kNotConverged when a contact
// search does not settle. Other errors: of truth_brain and contact::ForwardModel.
Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress = {});
// The same with a brain and a solver that exist already, for several scenarios on one brain.
// Precondition: truth_brain() made the brain for the same stiffness, resection and seed; what the
// solver says is of this brain with the contact boundary.
Result<SimulatedSurgery> play_scenario(const TruthBrain& brain, TruthSource& solver,
                                       const Scenario& scenario, std::uint64_t seed,
                                       const Progress& progress = {});

// What the scenario's instruments see of a displacement that is given at the nodes of the model,
// the same at every moment. Of the scenario's loads and stiffness nothing counts, of a resection
// that the cavity is neither seen nor scored. There is no truth scalar fluid_level_mm.
Result<SimulatedSurgery> play_given(const BrainModel& model, const CaseConfig& config,
                                    Scenario scenario, Points displacement, std::uint64_t seed);

}  // namespace brainshift::client
