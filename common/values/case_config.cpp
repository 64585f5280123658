// SPDX-License-Identifier: Apache-2.0
#include "common/values/case_config.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace brainshift {
namespace {

// Collects the first violated constraint.
class Checker {
 public:
  void require(bool ok, const std::string& key, double value, const std::string& constraint) {
    if (ok || !message_.empty()) return;
    std::ostringstream text;
    text << key << " = " << value << ": must be " << constraint;
    message_ = text.str();
  }
  void positive(const std::string& key, double value) {
    require(std::isfinite(value) && value > 0.0, key, value, "finite and > 0");
  }
  void not_negative(const std::string& key, double value) {
    require(std::isfinite(value) && value >= 0.0, key, value, "finite and >= 0");
  }
  void between(const std::string& key, double value, double low, double high) {
    std::ostringstream range;
    range << "between " << low << " and " << high;
    require(value >= low && value <= high, key, value, range.str());
  }
  void finite(const std::string& key, const Vec3& value) {
    for (int i = 0; i < 3; ++i) {
      require(std::isfinite(value[i]), key + "[" + std::to_string(i) + "]", value[i], "finite");
    }
  }
  void direction(const std::string& key, const Vec3& value) {
    finite(key, value);
    require(value.norm() > 1e-9, key + " length", value.norm(), "> 0");
  }
  void text(bool ok, const std::string& key, const std::string& constraint) {
    if (!ok && message_.empty()) message_ = key + ": " + constraint;
  }
  Status status() const {
    if (message_.empty()) return {};
    return fail(ErrorCode::kInvalidArgument, message_);
  }

 private:
  std::string message_;
};

void check_mesh(const CaseConfig& config, Checker& check) {
  if (const auto* generate = std::get_if<MeshGeneration>(&config.mesh)) {
    check.text(!config.brain.empty(), "images.brain", "must name a brain mask to mesh");
    // Below 1 mm a head has millions of tetrahedra; above 40 mm it is no longer a head.
    check.between("mesh.generate.edge_mm", generate->edge_mm, 1.0, 40.0);
    check.between("mesh.generate.tumour_edge_mm", generate->tumour_edge_mm, 0.5, 40.0);
    check.between("mesh.generate.craniotomy_edge_mm", generate->craniotomy_edge_mm, 0.5, 40.0);
    check.between("mesh.generate.smoothing_mm", generate->smoothing_mm, 0.0, 10.0);
    check.not_negative("mesh.generate.tumour_margin_mm", generate->tumour_margin_mm);
    check.not_negative("mesh.generate.craniotomy_margin_mm", generate->craniotomy_margin_mm);
  }
}

void check_geometry(const CaseConfig& config, Checker& check) {
  if (const auto* ellipsoid = std::get_if<TumourEllipsoid>(&config.tumour)) {
    check.finite("tumour.ellipsoid.centre_mm", ellipsoid->centre_mm);
    for (int i = 0; i < 3; ++i) {
      check.between("tumour.ellipsoid.semi_axes_mm[" + std::to_string(i) + "]",
                    ellipsoid->semi_axes_mm[i], 0.5, 80.0);
    }
  }
  check.finite("craniotomy.centre_mm", config.craniotomy.centre_mm);
  check.between("craniotomy.long_axis_mm", config.craniotomy.long_axis_mm, 1.0, 200.0);
  check.between("craniotomy.short_axis_mm", config.craniotomy.short_axis_mm, 1.0,
                config.craniotomy.long_axis_mm);
  check.direction("craniotomy.long_axis_direction", config.craniotomy.long_axis_direction);
  check.finite("brainstem.centre_mm", config.brainstem.centre_mm);
  check.between("brainstem.radius_mm", config.brainstem.radius_mm, 0.0, 60.0);
  check.direction("gravity.direction", config.gravity_direction);
}

}  // namespace

Status validate(const CaseConfig& config) {
  Checker check;
  check.text(!config.case_id.empty(), "case_id", "must not be empty");
  check_mesh(config, check);
  check_geometry(config, check);

  // Brain tissue: 100 Pa to 1 MPa covers gel phantoms to tendon; outside is a unit mistake.
  check.between("material.shear_modulus_pa", config.material.shear_modulus_pa, 100.0, 1e6);
  check.between("material.poisson_ratio", config.material.poisson_ratio, 0.0, 0.4999);
  const auto tissue = [&check](const std::string& key, const TissueStiffness& stiffness) {
    check.between(key + ".shear_modulus_pa", stiffness.shear_modulus_pa, 1.0, 1e9);
    check.between(key + ".poisson_ratio", stiffness.poisson_ratio, 0.0, 0.4999);
  };
  if (config.material.tumour) tissue("material.tumour", *config.material.tumour);
  for (const auto& [label, stiffness] : config.material.regions) {
    tissue("material.regions." + std::to_string(label), stiffness);
  }
  check.between("material.tissue_density_kg_m3", config.material.tissue_density_kg_m3, 500, 2000);
  check.between("material.fluid_density_saturated_kg_m3",
                config.material.fluid_density_saturated_kg_m3, 0, 2000);
  check.between("material.fluid_density_unsaturated_kg_m3",
                config.material.fluid_density_unsaturated_kg_m3, 0, 2000);
  // Gels to gravel; the ends keep the matrix of a step within what double precision carries.
  check.between("material.permeability_m3_s_kg", config.material.permeability_m3_s_kg, 1e-16, 1e-2);
  check.between("material.biot_coefficient", config.material.biot_coefficient, 0.0, 1.0);
  check.between("material.storage_per_pa", config.material.storage_per_pa, 0.0, 1.0);

  check.between("contact.gap_mm", config.contact.gap_mm, 0.0, 20.0);
  check.between("contact.slave_depth_mm", config.contact.slave_depth_mm, 0.0, 300.0);
  check.between("contact.penalty_n_per_mm", config.contact.penalty_n_per_mm, 1e-6, 1e9);

  check.between("prior.correlation_length_mm", config.prior.correlation_length_mm, 0.1, 200.0);
  check.positive("prior.force_density_sd_n_m3", config.prior.force_density_sd_n_m3);
  check.not_negative("prior.gravity_mode_sd", config.prior.gravity_mode_sd);
  check.between("prior.gravity_direction_sd_deg", config.prior.gravity_direction_sd_deg, 0.0, 80.0);
  for (std::size_t i = 0; i < config.prior.gravity_levels_mm.size(); ++i) {
    check.between("prior.gravity_levels_mm[" + std::to_string(i) + "]",
                  config.prior.gravity_levels_mm[i], -300.0, 300.0);
  }

  check.between("prior.swelling_strain_sd", config.prior.swelling_strain_sd, 0.0, 2.0);
  for (std::size_t i = 0; i < config.prior.swelling_radii_mm.size(); ++i) {
    check.between("prior.swelling_radii_mm[" + std::to_string(i) + "]",
                  config.prior.swelling_radii_mm[i], 1.0, 300.0);
  }
  check.between("inversion.sigma_mm", config.inversion.sigma_mm, 1e-6, 1e3);
  check.between("inversion.sparse_points", config.inversion.sparse_points, 3, 1e6);
  check.between("inversion.max_iterations", config.inversion.max_iterations, 1, 100000);
  check.between("inversion.relative_misfit_change", config.inversion.relative_misfit_change, 1e-12,
                1.0);
  check.between("sensing.max_age_s", config.sensing.max_age_s, 0.0, 1e6);
  check.between("sensing.surface_points", config.sensing.surface_points, 3, 1e6);
  check.between("sensing.surface_pose_sd_mm", config.sensing.surface_pose_sd_mm, 0.0, 100.0);
  check.between("sensing.surface_pose_sd_deg", config.sensing.surface_pose_sd_deg, 0.0, 45.0);
  check.between("condensed.max_rank", config.condensed.max_rank, 1, 2000);
  check.between("condensed.memory_limit_gib", config.condensed.memory_limit_gib, 0.1, 1e4);
  check.between("condensed.deadline_ms", config.condensed.deadline_ms, 0.1, 1e6);
  check.between("condensed.max_contact_iterations", config.condensed.max_contact_iterations, 1,
                1000);
  check.between("condensed.uncertainty_nodes", config.condensed.uncertainty_nodes, 8, 1e5);
  check.between("scene.region_of_interest_mm", config.scene.region_of_interest_mm, 1.0, 300.0);
  check.between("scene.pressure_step_s", config.scene.pressure_step_s, 1e-6, 1e9);
  return check.status();
}

double largest_poisson_ratio(const Material& material) {
  double largest = material.poisson_ratio;
  if (material.tumour) largest = std::max(largest, material.tumour->poisson_ratio);
  for (const auto& [label, tissue] : material.regions) {
    largest = std::max(largest, tissue.poisson_ratio);
  }
  return largest;
}

std::string_view to_string(SurfaceGuidance guidance) {
  return guidance == SurfaceGuidance::kDistances ? "distances" : "rigid";
}

std::string_view to_string(OutsideRegion outside) {
  return outside == OutsideRegion::kExtend ? "extend" : "refuse";
}

std::string_view to_string(Carry carry) {
  switch (carry) {
    case Carry::kAuto: return "auto";
    case Carry::kOn: return "on";
    case Carry::kOff: return "off";
  }
  return "auto";
}

}  // namespace brainshift
