// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/patient_twin.hpp"

#include <limits>
#include <utility>

#include "client/tools/replay/score.hpp"
#include "common/registration/icp.hpp"
#include "tests/evidence/calculix.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::PlayedBrain;

// True when another seed makes another brain of the same scenario.
bool has_seeded_brain(const client::Scenario& scenario) {
  const client::Adversity& adverse = scenario.adverse;
  return adverse.gap_seed || adverse.tissue_seed || adverse.penalty_factor != 1.0 ||
         adverse.segmentation_sd_mm > 0.0 || scenario.stiffness_sd > 0.0 || scenario.resection;
}

// Mean error at the tumour of the translation that brings the measured boundary onto its surface.
double shift_error(const BrainModel& model, const Observation& observation,
                   const io::SurgeryTruth& truth) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto* boundary = std::get_if<TumourBoundary>(&observation.body);
  const auto cross = truth.points.find("cross");
  if (boundary == nullptr || cross == truth.points.end()) return kNaN;
  const auto surface = geometry::ClosestPointIndex::build(model.tumour);
  if (!surface) return kNaN;
  registration::IcpOptions options;
  options.rotation = false;
  const auto fit =
      registration::align(boundary->points, *surface, RigidTransform::Identity(), options);
  if (!fit) return kNaN;
  const Vec3 shift = -fit->T_surface_points.translation();
  const Points errors = (-client::at_points(truth.displacement, cross->second)).colwise() + shift;
  return errors.colwise().norm().mean();
}

}  // namespace

const std::vector<TruthKind>& truth_kinds() {
  static const std::vector<TruthKind> kinds = [] {
    std::vector<TruthKind> all = {{"consistency", {}}};
    for (const client::IngredientInfo& info : client::all_ingredients()) {
      all.push_back({info.name, {info.ingredient}});
    }
    all.push_back({"all", *client::ingredients_from("all")});
    all.push_back({"calculix", {}, true});
    return all;
  }();
  return kinds;
}

const TruthKind* find_truth(const std::string& name) {
  for (const TruthKind& kind : truth_kinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

Result<PlayedBrain*> PatientTwin::brain_of(const client::Scenario& scenario, std::uint64_t seed) {
  const BrainModel* other = nullptr;
  if (scenario.adverse.other_mesh) {
    if (!anew_) {
      auto anew = client::mesh_anew(head_.config);
      if (!anew) return tl::unexpected(anew.error());
      anew_ = std::move(*anew);
    }
    other = &*anew_;
  }
  const bool seeded = has_seeded_brain(scenario);
  auto& kept = seeded ? latest_ : kept_[scenario.adverse.other_mesh];
  if (kept && !seeded) return kept.get();
  kept.reset();  // before the next one takes memory
  auto brain = client::truth_brain(*head_.model, head_.config, scenario, seed, other);
  if (!brain) return tl::unexpected(brain.error());
  auto made = surgeries::factorised(std::move(*brain));
  if (!made) return tl::unexpected(made.error());
  kept = std::move(*made);
  return kept.get();
}

Result<PlayedSurgery> PatientTwin::play(const TruthKind& truth, std::uint64_t seed) {
  const client::Scenario* plain = client::find_scenario("patient-" + std::to_string(patient_));
  const auto scenario =
      client::with_ingredients(*plain, truth.ingredients, head_.model->gravity_direction, seed);
  if (!scenario) return tl::unexpected(scenario.error());
  if (!truth.calculix) return play(*scenario, seed);
  const auto played = brain_of(*scenario, seed);
  if (!played) return tl::unexpected(played.error());
  return finish(play_calculix(**played, *scenario, seed));
}

Result<PlayedSurgery> PatientTwin::play(const client::Scenario& scenario, std::uint64_t seed) {
  const auto played = brain_of(scenario, seed);
  if (!played) return tl::unexpected(played.error());
  return finish(client::play_scenario((*played)->brain, (*played)->solver, scenario, seed));
}

// What instruments see of the displacement that CalculiX found under the patient's load.
Result<client::SimulatedSurgery> PatientTwin::play_calculix(const PlayedBrain& played,
                                                            client::Scenario scenario,
                                                            std::uint64_t seed) {
  auto displacement = read_calculix_truth(calculix_, patient_, head_.model->mesh.nodes);
  if (!displacement) return tl::unexpected(displacement.error());
  client::GivenTruth given(std::move(*displacement), played.forward.contact());
  scenario.tumour_displacement_mm.reset();  // the load is what it was
  return client::play_scenario(played.brain, given, scenario, seed);
}

Result<PlayedSurgery> PatientTwin::finish(Result<client::SimulatedSurgery> surgery) const {
  PlayedSurgery played;
  if (!surgery) {
    if (surgery.error().code != ErrorCode::kInvalidArgument) return tl::unexpected(surgery.error());
    played.reason = surgery.error().message;
    return played;
  }
  played.shift_tumour_mm = shift_error(*head_.model, surgery->observations[0], surgery->truths[0]);
  played.surgery = std::move(*surgery);
  return played;
}

}  // namespace brainshift::evidence
