// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "common/fem/biot_matrix.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::pipeline {
namespace {

// A slave that is less deep in the skull than this does not touch it: a thousandth of the gap.
constexpr double kTouches_mm = 1e-3;

// Seconds after which at most the given fraction is missing.
double drained_after_s(double fraction, double consolidation_s) {
  return -4.0 / (std::numbers::pi * std::numbers::pi) * std::log(fraction) * consolidation_s;
}

std::string at_most_mm(double error_mm) {
  return std::isfinite(error_mm) ? fmt::format("at most about {:.2f} mm", error_mm)
                                 : std::string("unknown");
}

tl::unexpected<Error> refused(const char* part, const char* value, const std::string& reason) {
  return invalid(fmt::format("scene.{} = {}: {}", part, value, reason));
}

bool has_gravity_modes(const PriorConfig& prior) {
  return prior.gravity_mode_sd > 0.0 && !prior.gravity_levels_mm.empty();
}

}  // namespace

Result<ScenePlan> plan_scene(const CaseConfig& config, Method method, Boundary boundary) {
  const SceneConfig& scene = config.scene;
  const std::string name(to_string(method));
  const bool condensed = method == Method::kCondensed;
  if (scene.pressure == Carry::kOn && method == Method::kIterativeSolver) {
    return refused("pressure", "on", "method " + name + " has no solver for pore pressure");
  }
  if (scene.contact == Carry::kOn && boundary == Boundary::kFixed) {
    return refused("contact", "on", "the fixed boundary has no contact");
  }
  if (scene.uncertainty == Carry::kOn && !condensed) {
    return refused("uncertainty", "on", "method " + name + " computes no standard deviation");
  }
  if (scene.gravity_modes == Carry::kOn && !has_gravity_modes(config.prior)) {
    return refused("gravity_modes", "on",
                   "prior.gravity_mode_sd and prior.gravity_levels_mm leave none");
  }
  if (scene.contact == Carry::kOff && !condensed && boundary == Boundary::kContact) {
    return refused("contact", "off", "method " + name + " always carries contact");
  }
  if (scene.gravity_modes == Carry::kOff && !condensed && has_gravity_modes(config.prior)) {
    return refused("gravity_modes", "off",
                   "method " + name + " always carries them; set prior.gravity_mode_sd to 0");
  }
  ScenePlan plan;
  plan.pressure = scene.pressure == Carry::kOn;
  plan.contact = boundary == Boundary::kContact && scene.contact != Carry::kOff;
  plan.uncertainty = condensed && scene.uncertainty != Carry::kOff;
  plan.gravity_modes = has_gravity_modes(config.prior) && scene.gravity_modes != Carry::kOff;
  plan.far_field = !condensed || scene.far_field != Carry::kOff;
  return plan;
}

std::vector<NodeIndex> region_of_interest(const BrainModel& model, double margin_mm) {
  std::vector<NodeIndex> region;
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  if (!tumour) return region;
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    const Vec3 node = model.mesh.nodes.col(i);
    const geometry::ClosestPoint closest = tumour->closest(node);
    const bool inside = tumour->triangle_normal(closest.triangle).dot(node - closest.point) <= 0.0;
    if (inside || closest.distance_mm <= margin_mm) region.push_back(i);
  }
  return region;
}

// ---------- what is left out ----------

std::vector<Omission> prior_omissions(const PriorConfig& prior) {
  struct Part {
    const char* name;
    const char* keys;
    bool off;
    double cortex_mm, tumour_mm;
    const char* instead = nullptr;  // the part that takes its place
  };
  const bool no_gravity = !has_gravity_modes(prior);
  const bool swells = prior.tumour_volume_strain_sd > 0.0 && !prior.tumour_volume_radii_mm.empty();
  const auto where_on = [](bool on, const char* name) { return on ? name : nullptr; };
  const char* const medium =
      where_on(prior.medium_density_sd_n_m3 > 0.0, "the medium residual field");
  const char* const coarse =
      where_on(prior.coarse_density_sd_n_m3 > 0.0, "the coarse residual field");
  const char* const tumour = where_on(swells, "swelling of the tumour");
  const Part parts[] = {
      {"gravity modes", "prior.gravity_mode_sd or prior.gravity_levels_mm", no_gravity, 2.1, 2.3},
      {"buoyancy across gravity", "prior.gravity_direction_sd_deg",
       !no_gravity && prior.gravity_direction_sd_deg == 0.0, 0.4, 0.4, coarse},  // at 10 degrees
      {"swelling of the tumour", "prior.tumour_volume_strain_sd or prior.tumour_volume_radii_mm",
       !swells, 1.7, 1.4},
      {"volume of the brain", "prior.brain_volume_strain_sd", prior.brain_volume_strain_sd == 0.0,
       0.4, 0.4},
      {"resection", "prior.resection_weight_sd and prior.resection_stress_sd_pa",
       prior.resection_weight_sd == 0.0 && prior.resection_stress_sd_pa == 0.0, 0.6, 0.6, tumour},
      {"pull at the opening", "prior.opening_pressure_sd_pa", prior.opening_pressure_sd_pa == 0.0,
       4.4, 1.3},
      {"instruments on the way to the tumour", "prior.tract_pressure_sd_pa",
       prior.tract_pressure_sd_pa == 0.0, 1.9, 1.6},
      {"fine residual field", "prior.force_density_sd_n_m3", prior.force_density_sd_n_m3 == 0.0,
       0.1, 0.1, medium},
      {"medium residual field", "prior.medium_density_sd_n_m3", prior.medium_density_sd_n_m3 == 0.0,
       0.8, 0.8},
      {"coarse residual field", "prior.coarse_density_sd_n_m3", prior.coarse_density_sd_n_m3 == 0.0,
       1.1, 1.2}};
  std::vector<Omission> omissions;
  for (const Part& part : parts) {
    if (!part.off) continue;
    if (part.instead != nullptr) {
      omissions.push_back(
          {part.name, fmt::format("{} is 0", part.keys),
           fmt::format("none seen in simulated surgeries: {} takes its place (docs/ablations.md)",
                       part.instead)});
      continue;
    }
    omissions.push_back({part.name, fmt::format("{} is 0 or empty", part.keys),
                         fmt::format("where it acts, about {:.1f} mm at the cortex and {:.1f} mm "
                                     "at the tumour (median of draws from the prior)",
                                     part.cortex_mm, part.tumour_mm)});
  }
  return omissions;
}

double consolidation_time_s(const TetMesh& mesh, const Material& material) {
  const double volume_mm3 = fem::nodal_volumes(mesh).sum();
  const double radius_mm = std::cbrt(3.0 * volume_mm3 / (4.0 * std::numbers::pi));
  return radius_mm * radius_mm / fem::consolidation_coefficient(fem::poro_material_from(material));
}

double undrained_fraction(double seconds, double consolidation_time_s) {
  return std::exp(-std::numbers::pi * std::numbers::pi / 4.0 * seconds / consolidation_time_s);
}

double implicit_step_fraction(double seconds, double consolidation_time_s) {
  return 1.0 / (1.0 + std::numbers::pi * std::numbers::pi / 4.0 * seconds / consolidation_time_s);
}

Omission pressure_omission(const TetMesh& mesh, const CaseConfig& config) {
  const double relaxation_s = consolidation_time_s(mesh, config.material);
  const double step_s = config.scene.pressure_step_s;
  return {
      "pressure",
      fmt::format("drained limit: pore pressure relaxes in about {:.3g} s (R^2/c_v)", relaxation_s),
      fmt::format("at most {:.2g} % of the displacement by a load {:.3g} s old, 1 % after {:.3g} "
                  "s; one implicit step (scene.pressure = on) differs by at most {:.2g} %",
                  100.0 * undrained_fraction(step_s, relaxation_s), step_s,
                  drained_after_s(0.01, relaxation_s),
                  100.0 * implicit_step_fraction(step_s, relaxation_s))};
}

std::vector<Omission> model_omissions(const BrainModel& model, const CaseConfig& config,
                                      Method method, Boundary boundary) {
  std::vector<Omission> omissions;
  if (config.scene.pressure != Carry::kOn) {
    omissions.push_back(pressure_omission(model.mesh, config));
  }
  const char* unaffected =
      "none: displacements are unaffected, their standard deviation is unknown";
  if (method != Method::kCondensed) {
    omissions.push_back(
        {"uncertainty",
         fmt::format("method {} computes no posterior covariance", to_string(method)), unaffected});
  } else if (config.scene.uncertainty == Carry::kOff) {
    omissions.push_back({"uncertainty", "scene.uncertainty = off", unaffected});
  }
  if (boundary == Boundary::kFixed) {
    omissions.push_back({"contact",
                         "fixed boundary: the brain surface cannot leave or approach the skull",
                         "about 1.8 mm at the craniotomy: in the paper's five cases 3.4 mm of "
                         "error remain there on average, 1.6 mm with contact"});
  }
  for (Omission& part : prior_omissions(config.prior)) omissions.push_back(std::move(part));
  return omissions;
}

std::vector<Omission> inversion_omissions(const CaseConfig& config, Boundary boundary,
                                          const inversion::OmissionErrors& errors,
                                          int active_slaves) {
  const SceneConfig& scene = config.scene;
  std::vector<Omission> omissions;
  if (boundary == Boundary::kContact && scene.contact == Carry::kOff) {
    const double nearest = errors.nearest_slave_mm;
    omissions.push_back(
        {"contact",
         nearest < 0.0
             ? fmt::format("scene.contact = off; the brain reaches {:.2f} mm into the skull",
                           -nearest)
             : fmt::format("scene.contact = off; the brain stays {:.2f} mm off the skull", nearest),
         at_most_mm(errors.contact_mm)});
  } else if (boundary == Boundary::kContact && scene.contact == Carry::kAuto &&
             active_slaves == 0 && errors.nearest_slave_mm > -kTouches_mm) {
    omissions.push_back({"contact",
                         fmt::format("no slave touches: the nearest stays {:.2f} mm off the skull",
                                     std::max(0.0, errors.nearest_slave_mm)),
                         at_most_mm(errors.contact_mm)});
  }
  if (has_gravity_modes(config.prior) && scene.gravity_modes == Carry::kOff) {
    omissions.push_back(
        {"gravity modes", "scene.gravity_modes = off", at_most_mm(errors.gravity_modes_mm)});
  }
  if (scene.far_field == Carry::kOff) {
    omissions.push_back(
        {"far field",
         fmt::format("scene.far_field = off: interpolated beyond {:g} mm from the tumour",
                     scene.region_of_interest_mm),
         at_most_mm(errors.far_field_mm)});
  }
  return omissions;
}

std::vector<Omission> registration_omissions(const registration::IcpResult& icp, Carry rotation,
                                             bool start_only) {
  std::vector<Omission> omissions;
  const std::string size = at_most_mm(icp.left_out_rotation_mm) + " at the tumour's surface";
  if (!start_only && rotation == Carry::kOff) {
    omissions.push_back({"rotation", "scene.rotation = off: only a translation is aligned", size});
  } else if (!start_only && rotation == Carry::kAuto && !icp.rotation_observable) {
    std::string axes;
    for (const std::string& axis : registration::not_shown(icp.observability)) axes += "; " + axis;
    omissions.push_back(
        {"rotation",
         fmt::format("the boundary shows {} of 6 rigid motions; the others are held by a prior of "
                     "{:.1f} deg{}",
                     icp.observable_axes, registration::IcpOptions{}.rotation_sd_deg, axes),
         size});
  }
  if (!icp.converged) {
    omissions.push_back({"registration convergence",
                         fmt::format("alignment stopped after {} iterations", icp.iterations),
                         fmt::format("residual {:.2f} mm rms", icp.rms_mm)});
  }
  return omissions;
}

}  // namespace brainshift::pipeline
