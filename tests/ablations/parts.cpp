// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/parts.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace brainshift::ablations {
namespace {

using evidence::Anew;
using Change = std::function<void(CaseConfig&)>;

constexpr double kLeastLength_mm = 1.0;  // the key's least value
// Of parts that are off: their values before decision 0030.
constexpr double kDensity_n_m3 = 1000.0, kDirectionSd_deg = 10.0;
constexpr double kWeightSd = 1.0, kStressSd_pa = 300.0;
// A tracked probe as decision 0020 has it, which a client would state.
constexpr double kProbePoseSd_mm = 0.5, kProbePoseSd_deg = 0.5;
constexpr int kLowRank = 104, kHighRank = 192;  // 92 are load families

Part part(std::string name, std::string variant, Anew anew, std::vector<std::string> keys,
          std::string change, Change to) {
  return {std::move(name),
          {std::move(variant), anew, Boundary::kContact, std::move(to)},
          std::move(keys),
          std::move(change)};
}

Part operators_part(const char* name, const char* variant, std::vector<std::string> keys,
                    const char* change, Change to) {
  return part(name, variant, Anew::kOperators, std::move(keys), change, std::move(to));
}

Part added(Part part) {
  part.added = true;
  return part;
}

std::vector<Part> boundary_parts() {
  Part contact = part("contact", "fixed", Anew::kOperators, {}, "boundary condition fixed", {});
  contact.variant.boundary = Boundary::kFixed;
  return {contact};
}

// Families of loads and the smooth remainder.
std::vector<Part> prior_parts() {
  return {
      operators_part("buoyancy", "no-buoyancy", {"prior.gravity_mode_sd"},
                     "`prior.gravity_mode_sd: 0`",
                     [](CaseConfig& c) { c.prior.gravity_mode_sd = 0.0; }),
      operators_part("swelling about the tumour", "no-tumour-volume",
                     {"prior.tumour_volume_strain_sd"}, "`prior.tumour_volume_strain_sd: 0`",
                     [](CaseConfig& c) { c.prior.tumour_volume_strain_sd = 0.0; }),
      operators_part("brain volume", "no-brain-volume", {"prior.brain_volume_strain_sd"},
                     "`prior.brain_volume_strain_sd: 0`",
                     [](CaseConfig& c) { c.prior.brain_volume_strain_sd = 0.0; }),
      operators_part("opening", "no-opening", {"prior.opening_pressure_sd_pa"},
                     "`prior.opening_pressure_sd_pa: 0`",
                     [](CaseConfig& c) { c.prior.opening_pressure_sd_pa = 0.0; }),
      operators_part("medium remainder", "no-medium", {"prior.medium_density_sd_n_m3"},
                     "`prior.medium_density_sd_n_m3: 0`",
                     [](CaseConfig& c) { c.prior.medium_density_sd_n_m3 = 0.0; }),
      operators_part("coarse remainder", "no-coarse", {"prior.coarse_density_sd_n_m3"},
                     "`prior.coarse_density_sd_n_m3: 0`",
                     [](CaseConfig& c) { c.prior.coarse_density_sd_n_m3 = 0.0; }),
      operators_part("correlation of the remainder", "uncorrelated",
                     {"prior.medium_length_mm", "prior.coarse_length_mm"},
                     "its lengths at their least: 1 mm",
                     [](CaseConfig& c) {
                       c.prior.medium_length_mm = c.prior.coarse_length_mm = kLeastLength_mm;
                     }),
      operators_part("rank", "low-rank", {"condensed.max_rank"}, "`condensed.max_rank: 104`",
                     [](CaseConfig& c) { c.condensed.max_rank = kLowRank; }),
  };
}

// What is made of the data of an update.
std::vector<Part> data_parts() {
  const auto of = [](const char* name, const char* variant, std::vector<std::string> keys,
                     const char* change, Change to) {
    return part(name, variant, Anew::kNothing, std::move(keys), change, std::move(to));
  };
  Part cortex =
      of("surface data and vessel tracks", "no-cortex", {}, "the tumour's data alone", {});
  cortex.variant.has_seen = [](const Observation& one) { return one.source == "ius"; };
  return {
      of("strengths from the data", "fixed-strengths", {"prior.scales"}, "`prior.scales: fixed`",
         [](CaseConfig& c) { c.prior.estimate_scales = false; }),
      of("shared errors of a surface", "no-shared-errors",
         {"sensing.surface_pose_sd_mm", "sensing.surface_pose_sd_deg"},
         "`sensing.surface_pose_sd_mm: 0`, `_deg: 0`",
         [](CaseConfig& c) { c.sensing.surface_pose_sd_mm = c.sensing.surface_pose_sd_deg = 0.0; }),
      of("robust weights", "no-robust-weights", {"sensing.outliers"}, "`sensing.outliers: kept`",
         [](CaseConfig& c) { c.sensing.robust_weights = false; }),
      of("error of a boundary's points", "no-boundary-error", {"sensing.boundary_error_sd_mm"},
         "`sensing.boundary_error_sd_mm: 0`",
         [](CaseConfig& c) { c.sensing.boundary_error_sd_mm = 0.0; }),
      of("averages of a boundary's points", "no-averages", {"sensing.boundary_average_mm"},
         "`sensing.boundary_average_mm: 0`",
         [](CaseConfig& c) { c.sensing.boundary_average_mm = 0.0; }),
      of("tumour as distances", "rigid-tumour", {"sensing.tumour"}, "`sensing.tumour: rigid`",
         [](CaseConfig& c) { c.sensing.tumour = SurfaceGuidance::kRigid; }),
      of("cortex as distances", "rigid-cortex", {"sensing.surface"}, "`sensing.surface: rigid`",
         [](CaseConfig& c) { c.sensing.surface = SurfaceGuidance::kRigid; }),
      cortex,
  };
}

// Parts that the default leaves out.
std::vector<Part> added_parts() {
  Part probe = part("shared error of the probe", "probe-pose", Anew::kNothing,
                    {"sensing.probe_pose_sd_mm", "sensing.probe_pose_sd_deg"},
                    "`sensing.probe_pose_sd_mm: 0.5`, `_deg: 0.5`", [](CaseConfig& c) {
                      c.sensing.probe_pose_sd_mm = kProbePoseSd_mm;
                      c.sensing.probe_pose_sd_deg = kProbePoseSd_deg;
                    });
  const Part fine = operators_part("fine remainder", "fine", {"prior.force_density_sd_n_m3"},
                                   "`prior.force_density_sd_n_m3: 1000`", [](CaseConfig& c) {
                                     c.prior.force_density_sd_n_m3 = kDensity_n_m3;
                                   });
  const Part across =
      operators_part("buoyancy across gravity", "across", {"prior.gravity_direction_sd_deg"},
                     "`prior.gravity_direction_sd_deg: 10`",
                     [](CaseConfig& c) { c.prior.gravity_direction_sd_deg = kDirectionSd_deg; });
  const Part resection = operators_part(
      "resection", "resection", {"prior.resection_weight_sd", "prior.resection_stress_sd_pa"},
      "`prior.resection_weight_sd: 1`, `resection_stress_sd_pa: 300`", [](CaseConfig& c) {
        c.prior.resection_weight_sd = kWeightSd;
        c.prior.resection_stress_sd_pa = kStressSd_pa;
      });
  const Part all = operators_part(
      "these three with room for their modes", "all-families",
      {"prior.force_density_sd_n_m3", "prior.gravity_direction_sd_deg", "prior.resection_weight_sd",
       "prior.resection_stress_sd_pa", "condensed.max_rank"},
      "all of these, and `condensed.max_rank: 192`", [](CaseConfig& c) {
        c.prior.force_density_sd_n_m3 = kDensity_n_m3;
        c.prior.gravity_direction_sd_deg = kDirectionSd_deg;
        c.prior.resection_weight_sd = kWeightSd;
        c.prior.resection_stress_sd_pa = kStressSd_pa;
        c.condensed.max_rank = kHighRank;
      });
  Part rank =
      part("a higher rank", "high-rank", Anew::kOperators, {"condensed.max_rank"},
           "`condensed.max_rank: 192`", [](CaseConfig& c) { c.condensed.max_rank = kHighRank; });
  Part refined =
      part("refinement", "refined", Anew::kMesh, {"mesh.tumour_edge_mm", "mesh.craniotomy_edge_mm"},
           "half the edge at tumour and rim (`mesh.generate.tumour_edge_mm`, "
           "`craniotomy_edge_mm`)",
           [](CaseConfig& c) {
             if (auto* mesh = std::get_if<MeshGeneration>(&c.mesh)) {
               mesh->tumour_edge_mm *= 0.5;
               mesh->craniotomy_edge_mm *= 0.5;
             }
           });
  Part pressure =
      part("pore pressure", "pressure", Anew::kOperators, {"scene.pressure"},
           "`scene.pressure: on`", [](CaseConfig& c) { c.scene.pressure = Carry::kOn; });
  pressure.slow = true;
  return {added(fine),  added(across), added(resection), added(all),
          added(probe), added(rank),   added(refined),   added(pressure)};
}

}  // namespace

const std::vector<Part>& all_parts() {
  static const std::vector<Part> parts = [] {
    std::vector<Part> all = {part("", kDefault, Anew::kNothing, {}, "nothing", {})};
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

const std::vector<LeftOut>& parts_left_out() {
  static const std::vector<LeftOut> parts = {
      {"evidence",
       "an update does not publish the evidence of its data: no -log evidence is shown"},
      {"model error", "the tenth of the motion that the medium remainder keeps has no key"},
      {"correlation of neighbouring boundary points", "no key: decision 0029 has figures"},
      {"calculix", "that truth belongs to the mesh with 18 thousand nodes"}};
  return parts;
}

}  // namespace brainshift::ablations
