// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/config_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "common/io/files/file_access.hpp"
#include "common/io/files/yaml_section.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

void read_images(YamlSection images, CaseConfig& config) {
  images.path("mri", config.mri);
  images.path("brain", config.brain);
  images.done();
}

void read_mesh(YamlSection mesh, CaseConfig& config) {
  if (mesh.one_of({"generate", "file"}, Presence::kOptional) == "file") {
    MeshFile file;
    mesh.path("file", file.path, Presence::kRequired);
    config.mesh = file;
  } else {
    MeshGeneration generate;
    YamlSection keys = mesh.section("generate");
    keys.number("edge_mm", generate.edge_mm);
    // Refinement is opt-in: without their own keys the regions get the general edge length.
    generate.tumour_edge_mm = generate.edge_mm;
    generate.craniotomy_edge_mm = generate.edge_mm;
    keys.number("tumour_edge_mm", generate.tumour_edge_mm);
    keys.number("craniotomy_edge_mm", generate.craniotomy_edge_mm);
    keys.number("tumour_margin_mm", generate.tumour_margin_mm);
    keys.number("craniotomy_margin_mm", generate.craniotomy_margin_mm);
    keys.number("smoothing_mm", generate.smoothing_mm);
    keys.done();
    config.mesh = generate;
  }
  mesh.done();
}

void read_tumour(YamlSection tumour, CaseConfig& config) {
  const std::string kind =
      tumour.one_of({"ellipsoid", "label_volume", "surface"}, Presence::kRequired);
  YamlSection keys = tumour.section(kind);
  if (kind == "ellipsoid") {
    TumourEllipsoid ellipsoid;
    keys.vector3("centre_mm", ellipsoid.centre_mm, Presence::kRequired);
    keys.vector3("semi_axes_mm", ellipsoid.semi_axes_mm, Presence::kRequired);
    config.tumour = ellipsoid;
  } else if (kind == "label_volume") {
    TumourLabel label;
    keys.path("file", label.path, Presence::kRequired);
    keys.integer("label", label.label);
    config.tumour = label;
  } else if (kind == "surface") {
    TumourSurface surface;
    keys.path("file", surface.path, Presence::kRequired);
    config.tumour = surface;
  }
  keys.done();
  tumour.done();
}

void read_anatomy(YamlSection& root, CaseConfig& config) {
  YamlSection craniotomy = root.section("craniotomy", Presence::kRequired);
  craniotomy.vector3("centre_mm", config.craniotomy.centre_mm, Presence::kRequired);
  craniotomy.number("long_axis_mm", config.craniotomy.long_axis_mm);
  craniotomy.number("short_axis_mm", config.craniotomy.short_axis_mm);
  craniotomy.vector3("long_axis_direction", config.craniotomy.long_axis_direction);
  craniotomy.done();

  YamlSection brainstem = root.section("brainstem", Presence::kRequired);
  brainstem.vector3("centre_mm", config.brainstem.centre_mm, Presence::kRequired);
  brainstem.number("radius_mm", config.brainstem.radius_mm);
  brainstem.done();

  YamlSection gravity = root.section("gravity");
  gravity.vector3("direction", config.gravity_direction);
  gravity.done();
}

void read_physics(YamlSection& root, CaseConfig& config) {
  YamlSection material = root.section("material");
  material.number("shear_modulus_pa", config.material.shear_modulus_pa);
  material.number("poisson_ratio", config.material.poisson_ratio);
  material.number("tissue_density_kg_m3", config.material.tissue_density_kg_m3);
  material.number("fluid_density_saturated_kg_m3", config.material.fluid_density_saturated_kg_m3);
  material.number("fluid_density_unsaturated_kg_m3",
                  config.material.fluid_density_unsaturated_kg_m3);
  material.number("permeability_m3_s_kg", config.material.permeability_m3_s_kg);
  material.number("biot_coefficient", config.material.biot_coefficient);
  material.number("storage_per_pa", config.material.storage_per_pa);
  const auto read_tissue = [&config](YamlSection section) {
    // What is not given is that of the rest.
    TissueStiffness tissue{config.material.shear_modulus_pa, config.material.poisson_ratio};
    section.number("shear_modulus_pa", tissue.shear_modulus_pa);
    section.number("poisson_ratio", tissue.poisson_ratio);
    section.done();
    return tissue;
  };
  if (material.has("tumour")) config.material.tumour = read_tissue(material.section("tumour"));
  if (material.has("regions")) {
    YamlSection regions = material.section("regions");
    for (const std::string& label : regions.names()) {
      int number = 0;
      const char* end = label.data() + label.size();
      const auto [stop, error] = std::from_chars(label.data(), end, number);
      if (error != std::errc() || stop != end) {
        regions.fail(label, "must be a label of the mesh, a whole number");
        break;
      }
      config.material.regions[number] = read_tissue(regions.section(label));
    }
    regions.done();
  }
  material.done();

  YamlSection contact = root.section("contact");
  contact.number("gap_mm", config.contact.gap_mm);
  if (contact.has("skull_file")) {
    contact.path("skull_file", config.contact.skull_file.emplace(), Presence::kRequired);
  }
  contact.number("slave_depth_mm", config.contact.slave_depth_mm);
  contact.number("penalty_n_per_mm", config.contact.penalty_n_per_mm);
  contact.done();
}

void read_estimation(YamlSection& root, CaseConfig& config) {
  YamlSection prior = root.section("prior");
  prior.number("correlation_length_mm", config.prior.correlation_length_mm);
  prior.number("force_density_sd_n_m3", config.prior.force_density_sd_n_m3);
  prior.number("gravity_mode_sd", config.prior.gravity_mode_sd);
  prior.number("gravity_direction_sd_deg", config.prior.gravity_direction_sd_deg);
  prior.numbers("gravity_levels_mm", config.prior.gravity_levels_mm);
  prior.number("swelling_strain_sd", config.prior.swelling_strain_sd);
  prior.numbers("swelling_radii_mm", config.prior.swelling_radii_mm);
  std::string scales = config.prior.estimate_scales ? "estimated" : "fixed";
  prior.choice("scales", scales, {"estimated", "fixed"});
  config.prior.estimate_scales = scales == "estimated";
  prior.done();

  YamlSection inversion = root.section("inversion");
  inversion.number("sigma_mm", config.inversion.sigma_mm);
  inversion.integer("sparse_points", config.inversion.sparse_points);
  inversion.integer("max_iterations", config.inversion.max_iterations);
  inversion.number("relative_misfit_change", config.inversion.relative_misfit_change);
  inversion.done();

  YamlSection sensing = root.section("sensing");
  sensing.number("max_age_s", config.sensing.max_age_s);
  std::string outliers = config.sensing.robust_weights ? "downweighted" : "kept";
  sensing.choice("outliers", outliers, {"downweighted", "kept"});
  config.sensing.robust_weights = outliers == "downweighted";
  std::string guidance(to_string(config.sensing.surface));
  sensing.choice("surface", guidance, {"distances", "rigid"});
  config.sensing.surface =
      guidance == "rigid" ? SurfaceGuidance::kRigid : SurfaceGuidance::kDistances;
  sensing.integer("surface_points", config.sensing.surface_points);
  sensing.number("surface_pose_sd_mm", config.sensing.surface_pose_sd_mm);
  sensing.number("surface_pose_sd_deg", config.sensing.surface_pose_sd_deg);
  sensing.done();

  YamlSection condensed = root.section("condensed");
  condensed.integer("max_rank", config.condensed.max_rank);
  condensed.number("memory_limit_gib", config.condensed.memory_limit_gib);
  condensed.number("deadline_ms", config.condensed.deadline_ms);
  condensed.integer("max_contact_iterations", config.condensed.max_contact_iterations);
  condensed.integer("uncertainty_nodes", config.condensed.uncertainty_nodes);
  std::string outside(to_string(config.condensed.outside_region));
  condensed.choice("outside_region", outside, {"extend", "refuse"});
  config.condensed.outside_region =
      outside == "extend" ? OutsideRegion::kExtend : OutsideRegion::kRefuse;
  condensed.done();
}

void read_scene(YamlSection& root, CaseConfig& config) {
  YamlSection scene = root.section("scene");
  const auto carry = [&scene](const std::string& key, Carry& value) {
    std::string word(to_string(value));
    scene.choice(key, word, {"auto", "on", "off"});
    value = word == "on" ? Carry::kOn : word == "off" ? Carry::kOff : Carry::kAuto;
  };
  carry("pressure", config.scene.pressure);
  carry("contact", config.scene.contact);
  carry("rotation", config.scene.rotation);
  carry("surface", config.scene.surface);
  carry("uncertainty", config.scene.uncertainty);
  carry("gravity_modes", config.scene.gravity_modes);
  carry("far_field", config.scene.far_field);
  scene.number("region_of_interest_mm", config.scene.region_of_interest_mm);
  scene.number("pressure_step_s", config.scene.pressure_step_s);
  scene.done();
}

// Length 1; a direction that has it already keeps its bits, so that a stored case reads back unchanged.
Vec3 unit(const Vec3& direction) {
  const double length = direction.norm();
  return std::abs(length - 1.0) < 1e-15 ? direction : direction / length;
}

Status check_endpoint(const std::string& endpoint) {
  const bool ipc = endpoint.rfind("ipc://", 0) == 0 && endpoint.size() > 6;
  const std::size_t colon = endpoint.rfind(':');
  const bool tcp = endpoint.rfind("tcp://", 0) == 0 && colon > 6 && colon + 1 < endpoint.size();
  if (ipc || tcp) return {};
  return fail(ErrorCode::kInvalidArgument,
              "endpoint = " + endpoint + ": must be tcp://HOST:PORT or ipc://PATH");
}

Status check_range(const std::string& key, int value, int low, int high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorCode::kInvalidArgument, key + " = " + std::to_string(value) +
                                               ": must be between " + std::to_string(low) +
                                               " and " + std::to_string(high));
}

Status validate(const DaemonConfig& config) {
  constexpr std::array<const char*, 5> kLevels = {"trace", "debug", "info", "warn", "error"};
  if (std::find(kLevels.begin(), kLevels.end(), config.log_level) == kLevels.end()) {
    return fail(ErrorCode::kInvalidArgument,
                "log_level = " + config.log_level + ": must be trace, debug, info, warn or error");
  }
  return check_endpoint(config.endpoint)
      .and_then([&] { return check_range("max_clients", config.max_clients, 1, 1024); })
      .and_then([&] { return check_range("max_message_mib", config.max_message_mib, 1, 1024); });
}

}  // namespace

Result<CaseConfig> parse_case_config(const std::string& text, const fs::path& file) {
  YamlDocument document = YamlDocument::parse(text, file);
  YamlSection root = document.root();
  CaseConfig config;
  config.file = fs::absolute(file).lexically_normal();
  root.text("case_id", config.case_id, Presence::kRequired);
  read_images(root.section("images"), config);
  read_mesh(root.section("mesh"), config);
  read_tumour(root.section("tumour", Presence::kRequired), config);
  read_anatomy(root, config);
  read_physics(root, config);
  read_estimation(root, config);
  read_scene(root, config);
  root.done();
  if (Status status = document.status(); !status) return tl::unexpected(status.error());
  if (Status status = brainshift::validate(config); !status) {
    return tl::unexpected(document.locate(status.error()));
  }
  config.gravity_direction = unit(config.gravity_direction);
  config.craniotomy.long_axis_direction = unit(config.craniotomy.long_axis_direction);
  return config;
}

Result<CaseConfig> read_case_config(const fs::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_case_config(*text, path);
}

Result<DaemonConfig> read_daemon_config(const fs::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  YamlDocument document = YamlDocument::parse(*text, path);
  YamlSection root = document.root();
  DaemonConfig config;
  root.text("endpoint", config.endpoint);
  root.path("model", config.model);
  root.path("journal_dir", config.journal_dir);
  root.text("log_level", config.log_level);
  root.integer("max_clients", config.max_clients);
  root.integer("max_message_mib", config.max_message_mib);
  root.done();
  if (Status status = document.status(); !status) return tl::unexpected(status.error());
  if (Status status = validate(config); !status) {
    return tl::unexpected(document.locate(status.error()));
  }
  return config;
}

}  // namespace brainshift::io
