// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/adverse.hpp"

#include <sstream>

#include "common/core/random.hpp"

namespace brainshift::client {
namespace {

// Numbers of an ingredient's own stream; the constant keeps them from those of noise and variation.
std::uint64_t stream(Ingredient ingredient, std::uint64_t seed) {
  return seed * 64 + 1 + static_cast<std::uint64_t>(ingredient) + 0x6164766572ULL;
}

double sign(Random& random) { return random.uniform() < 0.5 ? -1.0 : 1.0; }

Result<Ingredient> ingredient_from(const std::string& name) {
  std::string known;
  for (const IngredientInfo& info : all_ingredients()) {
    if (info.name == name) return info.ingredient;
    known += (known.empty() ? "" : ", ") + info.name;
  }
  return fail(ErrorCode::kNotFound,
              "adverse ingredient \"" + name + "\" is unknown; known: all, " + known);
}

void add(Ingredient ingredient, const Vec3& gravity, std::uint64_t seed, Scenario& scenario) {
  Random random(seed);
  Adversity& adverse = scenario.adverse;
  ProbeErrors& probe = adverse.probe;
  switch (ingredient) {
    case Ingredient::kMesh: adverse.other_mesh = true; break;
    case Ingredient::kGap: adverse.gap_seed = seed; break;
    case Ingredient::kPenalty:
      adverse.penalty_factor = sign(random) < 0.0 ? 1.0 / kPenaltyFactor : kPenaltyFactor;
      break;
    case Ingredient::kStiffness: adverse.tissue_seed = seed; break;
    case Ingredient::kLevel: adverse.level_error_mm = kLevel_mm * sign(random); break;
    case Ingredient::kGravity: {
      const Vec3 axis = gravity.cross(random.direction()).normalized();
      adverse.gravity_error_deg = kGravity_deg * axis;
      break;
    }
    case Ingredient::kTracker:
      probe.tracker_sd_mm = kTrackerSd_mm;
      probe.tracker_sd_deg = kTrackerSd_deg;
      probe.tracker_seed = seed;
      break;
    case Ingredient::kCalibration:
      probe.calibration_sd_mm = kCalibrationSd_mm;
      probe.calibration_sd_deg = kCalibrationSd_deg;
      probe.scale_sd = kScaleSd;
      probe.calibration_seed = seed;
      break;
    case Ingredient::kSegmentation:
      adverse.segmentation_sd_mm = kSegmentationSd_mm;
      adverse.segmentation_seed = seed;
      break;
    case Ingredient::kPartialSweep:
      probe.swept_part = kSweptPart;
      probe.sweep_seed = seed;
      break;
  }
}

}  // namespace

const std::vector<IngredientInfo>& all_ingredients() {
  static const std::vector<IngredientInfo> infos = {
      {Ingredient::kMesh, "mesh", "another mesh of the head, with quadratic elements"},
      {Ingredient::kGap, "gap", "a gap between brain and skull that varies from 0.5 to 4 mm"},
      {Ingredient::kPenalty, "penalty", "contact ten times as stiff, or a tenth"},
      {Ingredient::kStiffness, "stiffness",
       "tumour, grey and white matter and ventricles 30 % stiffer or softer; 30 % more at 10 to 40 "
       "mm"},
      {Ingredient::kLevel, "level", "fluid 10 mm higher or lower"},
      {Ingredient::kGravity, "gravity", "gravity 10 degrees off"},
      {Ingredient::kTracker, "tracker",
       "every section of the probe off by 0.35 mm and 0.3 degrees"},
      {Ingredient::kCalibration, "calibration",
       "all sections off alike by 0.5 mm and 0.5 degrees, distances by 1 %"},
      {Ingredient::kSegmentation, "segmentation",
       "the tumour's outline off by 0.5 mm along its normal"},
      {Ingredient::kPartialSweep, "partial-sweep", "sections across 60 % of the tumour alone"}};
  return infos;
}

Result<Ingredients> ingredients_from(const std::string& list) {
  Ingredients ingredients;
  if (list == "all") {
    for (const IngredientInfo& info : all_ingredients()) ingredients.insert(info.ingredient);
    return ingredients;
  }
  std::istringstream parts(list);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto ingredient = ingredient_from(part);
    if (!ingredient) return tl::unexpected(ingredient.error());
    if (!ingredients.insert(*ingredient).second) {
      return invalid("adverse ingredient " + part + " is given twice");
    }
  }
  if (ingredients.empty() || list.back() == ',') {
    return invalid("adverse ingredients \"" + list + "\": a name is missing");
  }
  return ingredients;
}

std::string name_of(const Ingredients& ingredients) {
  if (ingredients.size() == all_ingredients().size()) return "all";
  std::string name;
  for (const IngredientInfo& info : all_ingredients()) {
    if (ingredients.count(info.ingredient) > 0) name += (name.empty() ? "" : "+") + info.name;
  }
  return name;
}

Result<Scenario> with_ingredients(const Scenario& scenario, const Ingredients& ingredients,
                                  const Vec3& gravity, std::uint64_t seed) {
  if (ingredients.count(Ingredient::kSegmentation) > 0 &&
      scenario.measurement != Measurement::kProbeSections) {
    return invalid("adverse ingredient segmentation does nothing in scenario " + scenario.name +
                   ": it measures displacements, not an outline");
  }
  if (ingredients.count(Ingredient::kMesh) > 0 && scenario.resection) {
    return invalid("adverse ingredient mesh: scenario " + scenario.name +
                   " cuts tissue out, which needs the case's mesh");
  }
  Scenario adverse = scenario;
  for (const Ingredient each : ingredients) add(each, gravity, stream(each, seed), adverse);
  if (adverse.adverse.tissue_seed) adverse.stiffness_sd = 0.0;
  return adverse;
}

}  // namespace brainshift::client
