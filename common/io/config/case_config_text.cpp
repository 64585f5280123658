// SPDX-License-Identifier: GPL-3.0-or-later
// case_config_text of config_file.hpp.
#include <cstdio>

#include "common/io/config/config_file.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

// Writes "key: value" lines; 17 significant digits give every double back.
class Writer {
 public:
  void section(const std::string& name) { text_ += name + ":\n"; }
  void number(const std::string& key, double value) { line(key, digits(value)); }
  void integer(const std::string& key, int value) { line(key, std::to_string(value)); }
  void text(const std::string& key, const std::string& value) { line(key, quoted(value)); }
  void path(const std::string& key, const fs::path& value) {
    text(key, value.empty() ? "" : fs::absolute(value).lexically_normal().string());
  }
  template <typename List>
  void list(const std::string& key, const List& values) {
    std::string items;
    for (const double value : values) items += (items.empty() ? "" : ", ") + digits(value);
    line(key, "[" + items + "]");
  }
  const std::string& result() const { return text_; }

 private:
  static std::string digits(double value) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.17g", value);
    return buffer;
  }
  // Double-quoted YAML: only these need an escape in printable text; control characters by number.
  static std::string quoted(const std::string& value) {
    std::string out = "\"";
    for (const char c : value) {
      if (c == '"' || c == '\\') {
        out += '\\';
        out += c;
      } else if (static_cast<unsigned char>(c) < 0x20) {
        char buffer[8];
        std::snprintf(buffer, sizeof buffer, "\\x%02x", static_cast<unsigned>(c));
        out += buffer;
      } else {
        out += c;
      }
    }
    return out + "\"";
  }
  void line(const std::string& key, const std::string& value) {
    text_ += key + ": " + value + "\n";
  }
  std::string text_;
};

void write_mesh(const CaseConfig& config, Writer& out) {
  out.section("mesh");
  if (const auto* file = std::get_if<MeshFile>(&config.mesh)) {
    out.path("  file", file->path);
    return;
  }
  const auto& generate = std::get<MeshGeneration>(config.mesh);
  out.section("  generate");
  out.number("    edge_mm", generate.edge_mm);
  out.number("    tumour_edge_mm", generate.tumour_edge_mm);
  out.number("    craniotomy_edge_mm", generate.craniotomy_edge_mm);
  out.number("    tumour_margin_mm", generate.tumour_margin_mm);
  out.number("    craniotomy_margin_mm", generate.craniotomy_margin_mm);
  out.number("    smoothing_mm", generate.smoothing_mm);
}

void write_tumour(const CaseConfig& config, Writer& out) {
  out.section("tumour");
  if (const auto* ellipsoid = std::get_if<TumourEllipsoid>(&config.tumour)) {
    out.section("  ellipsoid");
    out.list("    centre_mm", ellipsoid->centre_mm);
    out.list("    semi_axes_mm", ellipsoid->semi_axes_mm);
  } else if (const auto* label = std::get_if<TumourLabel>(&config.tumour)) {
    out.section("  label_volume");
    out.path("    file", label->path);
    out.integer("    label", label->label);
  } else {
    out.section("  surface");
    out.path("    file", std::get<TumourSurface>(config.tumour).path);
  }
}

void write_anatomy(const CaseConfig& config, Writer& out) {
  out.section("craniotomy");
  out.list("  centre_mm", config.craniotomy.centre_mm);
  out.number("  long_axis_mm", config.craniotomy.long_axis_mm);
  out.number("  short_axis_mm", config.craniotomy.short_axis_mm);
  out.list("  long_axis_direction", config.craniotomy.long_axis_direction);
  out.section("brainstem");
  out.list("  centre_mm", config.brainstem.centre_mm);
  out.number("  radius_mm", config.brainstem.radius_mm);
  out.section("gravity");
  out.list("  direction", config.gravity_direction);
}

void write_physics(const CaseConfig& config, Writer& out) {
  out.section("material");
  out.number("  shear_modulus_pa", config.material.shear_modulus_pa);
  out.number("  poisson_ratio", config.material.poisson_ratio);
  out.number("  tissue_density_kg_m3", config.material.tissue_density_kg_m3);
  out.number("  fluid_density_saturated_kg_m3", config.material.fluid_density_saturated_kg_m3);
  out.number("  fluid_density_unsaturated_kg_m3", config.material.fluid_density_unsaturated_kg_m3);
  out.number("  permeability_m3_s_kg", config.material.permeability_m3_s_kg);
  out.number("  biot_coefficient", config.material.biot_coefficient);
  out.number("  storage_per_pa", config.material.storage_per_pa);
  const auto tissue = [&out](const std::string& indent, const TissueStiffness& stiffness) {
    out.number(indent + "shear_modulus_pa", stiffness.shear_modulus_pa);
    out.number(indent + "poisson_ratio", stiffness.poisson_ratio);
  };
  if (config.material.tumour) {
    out.section("  tumour");
    tissue("    ", *config.material.tumour);
  }
  if (!config.material.regions.empty()) out.section("  regions");
  for (const auto& [label, stiffness] : config.material.regions) {
    out.section("    " + std::to_string(label));
    tissue("      ", stiffness);
  }
  out.section("contact");
  out.number("  gap_mm", config.contact.gap_mm);
  if (config.contact.skull_file) out.path("  skull_file", *config.contact.skull_file);
  out.number("  slave_depth_mm", config.contact.slave_depth_mm);
  out.number("  penalty_n_per_mm", config.contact.penalty_n_per_mm);
}

void write_estimation(const CaseConfig& config, Writer& out) {
  out.section("prior");
  out.number("  correlation_length_mm", config.prior.correlation_length_mm);
  out.number("  force_density_sd_n_m3", config.prior.force_density_sd_n_m3);
  out.number("  gravity_mode_sd", config.prior.gravity_mode_sd);
  out.number("  gravity_direction_sd_deg", config.prior.gravity_direction_sd_deg);
  out.list("  gravity_levels_mm", config.prior.gravity_levels_mm);
  out.number("  swelling_strain_sd", config.prior.swelling_strain_sd);
  out.list("  swelling_radii_mm", config.prior.swelling_radii_mm);
  out.text("  scales", config.prior.estimate_scales ? "estimated" : "fixed");
  out.section("inversion");
  out.number("  sigma_mm", config.inversion.sigma_mm);
  out.integer("  sparse_points", config.inversion.sparse_points);
  out.integer("  max_iterations", config.inversion.max_iterations);
  out.number("  relative_misfit_change", config.inversion.relative_misfit_change);
  out.section("sensing");
  out.number("  max_age_s", config.sensing.max_age_s);
  out.text("  outliers", config.sensing.robust_weights ? "downweighted" : "kept");
  out.text("  surface", std::string(to_string(config.sensing.surface)));
  out.integer("  surface_points", config.sensing.surface_points);
  out.number("  surface_pose_sd_mm", config.sensing.surface_pose_sd_mm);
  out.number("  surface_pose_sd_deg", config.sensing.surface_pose_sd_deg);
  out.section("condensed");
  out.integer("  max_rank", config.condensed.max_rank);
  out.number("  memory_limit_gib", config.condensed.memory_limit_gib);
  out.number("  deadline_ms", config.condensed.deadline_ms);
  out.integer("  max_contact_iterations", config.condensed.max_contact_iterations);
  out.integer("  uncertainty_nodes", config.condensed.uncertainty_nodes);
  out.text("  outside_region", std::string(to_string(config.condensed.outside_region)));
  out.section("scene");
  const auto carry = [&out](const std::string& key, Carry value) {
    out.text("  " + key, std::string(to_string(value)));
  };
  carry("pressure", config.scene.pressure);
  carry("contact", config.scene.contact);
  carry("rotation", config.scene.rotation);
  carry("surface", config.scene.surface);
  carry("uncertainty", config.scene.uncertainty);
  carry("gravity_modes", config.scene.gravity_modes);
  carry("far_field", config.scene.far_field);
  out.number("  region_of_interest_mm", config.scene.region_of_interest_mm);
  out.number("  pressure_step_s", config.scene.pressure_step_s);
}

}  // namespace

std::string case_config_text(const CaseConfig& config) {
  Writer out;
  out.text("case_id", config.case_id);
  out.section("images");
  out.path("  mri", config.mri);
  out.path("  brain", config.brain);
  write_mesh(config, out);
  write_tumour(config, out);
  write_anatomy(config, out);
  write_physics(config, out);
  write_estimation(config, out);
  return out.result();
}

}  // namespace brainshift::io
