// SPDX-License-Identifier: GPL-3.0-or-later
// Adverse ingredients: what a simulated truth has and an estimate does not believe. Each is named,
// so that it can be switched on alone, and each has a stream of random numbers of its own, so that
// it is the same alone and among others. Without any the truth is the *consistency* truth: it comes
// from the estimate's own mesh, element, gap and material.
//
//   mesh          another mesh of the same head, with quadratic elements (other_mesh.hpp)
//   gap           between brain and skull, from kMinGap_mm to kMaxGap_mm, uniform there, varying
//                 over kGapLength_mm (truth.hpp); the estimate believes the case's
//   penalty       of contact, kPenaltyFactor times the case's, or that part of it
//   stiffness     of tumour, grey and white matter and ventricles, and within them at several
//                 lengths (vary_tissues in stiffness.hpp); takes the place of a scenario's own
//   level         of the fluid, kLevel_mm higher or lower than the scenario says
//   gravity       turned by kGravity_deg about an axis across it
//   tracker       of the ultrasound probe: every section lies elsewhere
//   calibration   of the probe: all sections lie elsewhere alike, and distances from the probe are
//                 wrong
//   segmentation  of the tumour: its true outline differs from the model's surface
//   partial-sweep sections cross kSweptPart of the tumour, from one side
//
// The magnitudes are guesses of what is plausible, made before any estimate was scored on them.
//   gap             the fluid between brain and skull is a fraction of a millimetre to some
//                   millimetres thick, more over sulci and in older patients
//   tracker         optical trackers are specified at 0.25 to 0.35 mm in their volume
//   calibration     of a tracked probe: half a millimetre to a millimetre in published phantoms;
//                   the speed of sound in soft tissues differs by a percent
//   segmentation    half a voxel of the MRI (1 mm) and what two observers differ by
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

enum class Ingredient {
  kMesh,
  kGap,
  kPenalty,
  kStiffness,
  kLevel,
  kGravity,
  kTracker,
  kCalibration,
  kSegmentation,
  kPartialSweep
};
using Ingredients = std::set<Ingredient>;

struct IngredientInfo {
  Ingredient ingredient;
  std::string name;
  std::string description;  // one line
};
const std::vector<IngredientInfo>& all_ingredients();

inline constexpr double kMinGap_mm = 0.5, kMaxGap_mm = 4.0, kGapLength_mm = 30.0;
inline constexpr double kPenaltyFactor = 10.0;
inline constexpr double kLevel_mm = 10.0;
inline constexpr double kGravity_deg = 10.0;
inline constexpr double kTrackerSd_mm = 0.35, kTrackerSd_deg = 0.3;
inline constexpr double kCalibrationSd_mm = 0.5, kCalibrationSd_deg = 0.5, kScaleSd = 0.01;
inline constexpr double kSegmentationSd_mm = 0.5;
inline constexpr double kSweptPart = 0.6;

// "mesh,gap", or "all". kNotFound names the part that is unknown and lists what is known;
// kInvalidArgument: an empty part, or one that stands twice.
Result<Ingredients> ingredients_from(const std::string& list);
// The names joined by '+' in the order above; "all" for all of them, "" for none.
std::string name_of(const Ingredients& ingredients);

// The scenario with these ingredients. gravity: unit vector of the case. kInvalidArgument when an
// ingredient cannot do anything in this scenario: the sentence says why. What it does on a case is
// for play_scenario to check.
Result<Scenario> with_ingredients(const Scenario& scenario, const Ingredients& ingredients,
                                  const Vec3& gravity, std::uint64_t seed);

}  // namespace brainshift::client
