// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/parts.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace brainshift::ablations {
namespace {

using evidence::Anew;
using Change = std::function<void(CaseConfig&)>;

constexpr double kMinLength_mm = 1.0;  // the key's least value
// Of parts that are off: their values before decision 0030.
constexpr double kDensity_n_m3 = 1000.0, kDirectionSd_deg = 10.0;
constexpr double kWeightSd = 1.0, kStressSd_pa = 300.0;
// A tracked probe as decision 0020 has it, which a client would state.
constexpr double kProbePoseSd_mm = 0.5, kProbePoseSd_deg = 0.5;
// Half as many and twice as many modes of residual fields beside the 125 of load families.
constexpr int kLowRank = 157, kHighRank = 253;

Part part(std::string variant, Anew anew, std::vector<std::string> keys, Change change) {
  return {{std::move(variant), anew, Boundary::kContact, std::move(change)}, std::move(keys)};
}

std::vector<Part> boundary_parts() {
  Part contact = part("fixed", Anew::kOperators, {}, {});
  contact.variant.boundary = Boundary::kFixed;
  return {contact};
}

// Families of loads and the smooth residual fields.
std::vector<Part> prior_parts() {
  const auto of = [](const char* variant, std::vector<std::string> keys, Change change) {
    return part(variant, Anew::kOperators, std::move(keys), std::move(change));
  };
  return {
      of("no-buoyancy", {"prior.gravity_mode_sd"},
         [](CaseConfig& c) { c.prior.gravity_mode_sd = 0.0; }),
      of("no-tumour-volume", {"prior.tumour_volume_strain_sd"},
         [](CaseConfig& c) { c.prior.tumour_volume_strain_sd = 0.0; }),
      of("no-brain-volume", {"prior.brain_volume_strain_sd"},
         [](CaseConfig& c) { c.prior.brain_volume_strain_sd = 0.0; }),
      of("no-opening", {"prior.opening_pressure_sd_pa"},
         [](CaseConfig& c) { c.prior.opening_pressure_sd_pa = 0.0; }),
      of("no-unevenness", {"prior.gravity_sides_sd", "prior.gravity_ends_sd"},
         [](CaseConfig& c) { c.prior.gravity_sides_sd = c.prior.gravity_ends_sd = 0.0; }),
      of("no-tract", {"prior.tract_pressure_sd_pa"},
         [](CaseConfig& c) { c.prior.tract_pressure_sd_pa = 0.0; }),
      of("no-ventricle-volume", {"prior.ventricle_volume_strain_sd"},
         [](CaseConfig& c) { c.prior.ventricle_volume_strain_sd = 0.0; }),
      of("no-medium", {"prior.medium_density_sd_n_m3"},
         [](CaseConfig& c) { c.prior.medium_density_sd_n_m3 = 0.0; }),
      of("no-coarse", {"prior.coarse_density_sd_n_m3"},
         [](CaseConfig& c) { c.prior.coarse_density_sd_n_m3 = 0.0; }),
      of("uncorrelated", {"prior.medium_length_mm", "prior.coarse_length_mm"},
         [](CaseConfig& c) {
           c.prior.medium_length_mm = c.prior.coarse_length_mm = kMinLength_mm;
         }),
      of("low-rank", {"condensed.max_rank"},
         [](CaseConfig& c) { c.condensed.max_rank = kLowRank; }),
  };
}

// What is made of the data of an update.
std::vector<Part> data_parts() {
  const auto of = [](const char* variant, std::vector<std::string> keys, Change change) {
    return part(variant, Anew::kNothing, std::move(keys), std::move(change));
  };
  Part cortex = of("no-cortex", {}, {});
  cortex.variant.has_seen = [](const Observation& one) { return one.source == "ius"; };
  return {
      of("fixed-strengths", {"prior.scales"},
         [](CaseConfig& c) { c.prior.estimate_scales = false; }),
      of("no-broad-hypothesis", {"prior.broad_weight"},
         [](CaseConfig& c) { c.prior.broad_weight = 0.0; }),
      of("no-shared-errors", {"sensing.surface_pose_sd_mm", "sensing.surface_pose_sd_deg"},
         [](CaseConfig& c) { c.sensing.surface_pose_sd_mm = c.sensing.surface_pose_sd_deg = 0.0; }),
      of("no-robust-weights", {"sensing.outliers"},
         [](CaseConfig& c) { c.sensing.robust_weights = false; }),
      of("no-boundary-error", {"sensing.boundary_error_sd_mm"},
         [](CaseConfig& c) { c.sensing.boundary_error_sd_mm = 0.0; }),
      of("no-outline-errors", {"sensing.boundary_outline_errors"},
         [](CaseConfig& c) { c.sensing.boundary_outline_errors = false; }),
      of("no-averages", {"sensing.boundary_average_mm"},
         [](CaseConfig& c) { c.sensing.boundary_average_mm = 0.0; }),
      of("rigid-tumour", {"sensing.tumour"},
         [](CaseConfig& c) { c.sensing.tumour = SurfaceGuidance::kRigid; }),
      of("rigid-cortex", {"sensing.surface"},
         [](CaseConfig& c) { c.sensing.surface = SurfaceGuidance::kRigid; }),
      cortex,
  };
}

// Parts that the default leaves out.
std::vector<Part> added_parts() {
  Part pressure = part("pressure", Anew::kOperators, {"scene.pressure"},
                       [](CaseConfig& c) { c.scene.pressure = Carry::kOn; });
  pressure.slow = true;
  return {
      part("fine", Anew::kOperators, {"prior.force_density_sd_n_m3"},
           [](CaseConfig& c) { c.prior.force_density_sd_n_m3 = kDensity_n_m3; }),
      part("across", Anew::kOperators, {"prior.gravity_direction_sd_deg"},
           [](CaseConfig& c) { c.prior.gravity_direction_sd_deg = kDirectionSd_deg; }),
      part("resection", Anew::kOperators,
           {"prior.resection_weight_sd", "prior.resection_stress_sd_pa"},
           [](CaseConfig& c) {
             c.prior.resection_weight_sd = kWeightSd;
             c.prior.resection_stress_sd_pa = kStressSd_pa;
           }),
      part("all-families", Anew::kOperators,
           {"prior.force_density_sd_n_m3", "prior.gravity_direction_sd_deg",
            "prior.resection_weight_sd", "prior.resection_stress_sd_pa", "condensed.max_rank"},
           [](CaseConfig& c) {
             c.prior.force_density_sd_n_m3 = kDensity_n_m3;
             c.prior.gravity_direction_sd_deg = kDirectionSd_deg;
             c.prior.resection_weight_sd = kWeightSd;
             c.prior.resection_stress_sd_pa = kStressSd_pa;
             c.condensed.max_rank = kHighRank;
           }),
      part("probe-pose", Anew::kNothing, {"sensing.probe_pose_sd_mm", "sensing.probe_pose_sd_deg"},
           [](CaseConfig& c) {
             c.sensing.probe_pose_sd_mm = kProbePoseSd_mm;
             c.sensing.probe_pose_sd_deg = kProbePoseSd_deg;
           }),
      part("high-rank", Anew::kOperators, {"condensed.max_rank"},
           [](CaseConfig& c) { c.condensed.max_rank = kHighRank; }),
      part("refined", Anew::kMesh, {"mesh.tumour_edge_mm", "mesh.craniotomy_edge_mm"},
           [](CaseConfig& c) {
             if (auto* mesh = std::get_if<MeshGeneration>(&c.mesh)) {
               mesh->tumour_edge_mm *= 0.5;
               mesh->craniotomy_edge_mm *= 0.5;
             }
           }),
      pressure};
}

}  // namespace

const std::vector<Part>& all_parts() {
  static const std::vector<Part> parts = [] {
    std::vector<Part> all = {part(kDefault, Anew::kNothing, {}, {})};
    for (auto some : {boundary_parts(), prior_parts(), data_parts(), added_parts()}) {
      all.insert(all.end(), some.begin(), some.end());
    }
    return all;
  }();
  return parts;
}

const Part* find_part(const std::string& variant) {
  for (const Part& part : all_parts()) {
    if (part.variant.name == variant) return &part;
  }
  return nullptr;
}

Result<std::vector<Part>> parts_from(const std::vector<std::string>& variants) {
  for (const std::string& name : variants) {
    if (find_part(name) != nullptr) continue;
    std::string known;
    for (const Part& part : all_parts()) known += " " + part.variant.name;
    return fail(ErrorCode::kNotFound, "variant " + name + " is unknown; known are" + known);
  }
  std::vector<Part> chosen;
  for (const Part& part : all_parts()) {
    const std::string& name = part.variant.name;
    const bool wanted = std::find(variants.begin(), variants.end(), name) != variants.end();
    if (wanted || name == kDefault) chosen.push_back(part);
  }
  return chosen;
}

}  // namespace brainshift::ablations
