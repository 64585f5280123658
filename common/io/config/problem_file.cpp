// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/problem_file.hpp"

#include "common/io/files/file_access.hpp"
#include "common/io/files/yaml_section.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

void optional_number(YamlSection& section, const std::string& key, std::optional<double>& value) {
  if (section.has(key)) section.number(key, value.emplace());
}

void read_groups(YamlSection groups, ProblemSpec& problem) {
  for (const std::string& name : groups.names()) {
    YamlSection entry = groups.section(name, Presence::kRequired);
    const std::string kind = entry.one_of({"plane", "box", "sphere"}, Presence::kRequired);
    YamlSection keys = entry.section(kind);
    GroupSpec group{name, PlaneSelector{}};
    if (kind == "plane") {
      PlaneSelector plane;
      keys.vector3("point_mm", plane.point_mm, Presence::kRequired);
      keys.vector3("normal", plane.normal, Presence::kRequired);
      keys.number("tolerance_mm", plane.tolerance_mm, Presence::kRequired);
      group.where = plane;
    } else if (kind == "box") {
      BoxSelector box;
      keys.vector3("min_mm", box.min_mm, Presence::kRequired);
      keys.vector3("max_mm", box.max_mm, Presence::kRequired);
      group.where = box;
    } else if (kind == "sphere") {
      SphereSelector sphere;
      keys.vector3("centre_mm", sphere.centre_mm, Presence::kRequired);
      keys.number("radius_mm", sphere.radius_mm, Presence::kRequired);
      keys.number("tolerance_mm", sphere.tolerance_mm, Presence::kRequired);
      group.where = sphere;
    }
    keys.done();
    entry.done();
    problem.groups.push_back(std::move(group));
  }
}

void read_materials(YamlSection materials, ProblemSpec& problem) {
  for (const std::string& name : materials.names()) {
    YamlSection keys = materials.section(name, Presence::kRequired);
    MaterialSpec material;
    material.name = name;
    optional_number(keys, "youngs_modulus_pa", material.youngs_modulus_pa);
    optional_number(keys, "shear_modulus_pa", material.shear_modulus_pa);
    keys.number("poisson_ratio", material.poisson_ratio, Presence::kRequired);
    keys.number("density_kg_m3", material.density_kg_m3);
    keys.number("biot_coefficient", material.biot_coefficient);
    keys.number("storage_per_pa", material.storage_per_pa);
    keys.number("permeability_m3_s_kg", material.permeability_m3_s_kg);
    keys.done();
    problem.materials.push_back(std::move(material));
  }
}

void read_conditions(YamlSection conditions, ProblemSpec& problem) {
  for (const std::string& name : conditions.names()) {
    YamlSection keys = conditions.section(name, Presence::kRequired);
    ConditionSpec condition;
    condition.name = name;
    keys.text("on", condition.on, Presence::kRequired);
    if (keys.has("displacement_mm")) {
      Vec3 all = Vec3::Zero();
      keys.vector3("displacement_mm", all);
      for (int axis = 0; axis < 3; ++axis) {
        condition.displacement_mm[static_cast<std::size_t>(axis)] = all[axis];
      }
    } else {
      optional_number(keys, "displacement_x_mm", condition.displacement_mm[0]);
      optional_number(keys, "displacement_y_mm", condition.displacement_mm[1]);
      optional_number(keys, "displacement_z_mm", condition.displacement_mm[2]);
    }
    optional_number(keys, "normal_displacement_mm", condition.normal_displacement_mm);
    if (keys.has("traction_pa")) keys.vector3("traction_pa", condition.traction_pa.emplace());
    optional_number(keys, "pressure_pa", condition.pressure_pa);
    optional_number(keys, "pore_pressure_pa", condition.pore_pressure_pa);
    keys.done();
    problem.conditions.push_back(std::move(condition));
  }
}

void read_contact(YamlSection contacts, ProblemSpec& problem) {
  for (const std::string& name : contacts.names()) {
    YamlSection entry = contacts.section(name, Presence::kRequired);
    ContactSpec contact;
    contact.name = name;
    entry.text("on", contact.on, Presence::kRequired);
    const std::string kind = entry.one_of({"plane", "sphere", "surface"}, Presence::kRequired);
    if (kind == "surface") {
      SurfaceObstacleSpec surface;
      entry.path("surface", surface.file, Presence::kRequired);
      contact.obstacle = surface;
    } else {
      YamlSection keys = entry.section(kind);
      if (kind == "plane") {
        PlaneObstacleSpec plane;
        keys.vector3("point_mm", plane.point_mm, Presence::kRequired);
        keys.vector3("normal", plane.normal, Presence::kRequired);
        contact.obstacle = plane;
      } else if (kind == "sphere") {
        SphereObstacleSpec sphere;
        keys.vector3("centre_mm", sphere.centre_mm, Presence::kRequired);
        keys.number("radius_mm", sphere.radius_mm, Presence::kRequired);
        contact.obstacle = sphere;
      }
      keys.done();
    }
    optional_number(entry, "penalty_pa_per_mm", contact.penalty_pa_per_mm);
    entry.done();
    problem.contact.push_back(std::move(contact));
  }
}

// Every key of a problem file.
ProblemSpec read_keys(YamlDocument& document, const fs::path& file) {
  YamlSection root = document.root();
  ProblemSpec problem;
  problem.file = fs::absolute(file).lexically_normal();

  YamlSection mesh = root.section("mesh", Presence::kRequired);
  mesh.path("file", problem.mesh, Presence::kRequired);
  if (mesh.has("element")) mesh.choice("element", problem.element, {"p1", "p2"});
  mesh.done();
  read_groups(root.section("groups"), problem);
  read_materials(root.section("materials", Presence::kRequired), problem);
  YamlSection regions = root.section("regions", Presence::kRequired);
  for (const std::string& region : regions.names()) {
    std::string material;
    regions.text(region, material, Presence::kRequired);
    problem.regions.emplace_back(region, material);
  }
  YamlSection body = root.section("body");
  body.vector3("gravity_m_s2", problem.gravity_m_s2);
  body.vector3("force_n_m3", problem.body_force_n_m3);
  body.done();
  read_conditions(root.section("conditions"), problem);
  read_contact(root.section("contact"), problem);
  if (root.has("time")) {
    YamlSection time = root.section("time", Presence::kRequired);
    time.numbers("steps_s", problem.time.emplace().steps_s, Presence::kRequired);
    time.done();
  }
  YamlSection probes = root.section("probes");
  for (const std::string& name : probes.names()) {
    ProbeSpec probe{name, Vec3::Zero()};
    probes.vector3(name, probe.at_mm, Presence::kRequired);
    problem.probes.push_back(std::move(probe));
  }
  root.done();
  return problem;
}

}  // namespace

Result<ProblemSpec> parse_problem(const std::string& text, const fs::path& file) {
  YamlDocument document = YamlDocument::parse(text, file);
  ProblemSpec problem = read_keys(document, file);
  if (Status status = document.status(); !status) return tl::unexpected(status.error());
  if (Status status = brainshift::validate(problem); !status) {
    return tl::unexpected(document.locate(status.error()));
  }
  return problem;
}

Error locate_in_problem(const fs::path& path, const Error& error) {
  const Result<std::string> text = read_file(path);
  if (!text) return {error.code, path.string() + ": " + error.message};
  YamlDocument document = YamlDocument::parse(*text, path);
  read_keys(document, path);
  return document.locate(error);
}

Result<ProblemSpec> read_problem(const fs::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_problem(*text, path);
}

}  // namespace brainshift::io
