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

// Sections of which each is called by a name of the user's: read(keys, item) for each.
template <typename T, typename Read>
void read_named(YamlSection sections, std::vector<T>& items, const Read& read) {
  for (const std::string& name : sections.names()) {
    YamlSection keys = sections.section(name, kRequired);
    T item;
    item.name = name;
    read(keys, item);
    keys.done();
    items.push_back(std::move(item));
  }
}

void read_group(YamlSection& entry, GroupSpec& group) {
  const std::string kind = entry.one_of({"plane", "box", "sphere"}, kRequired);
  YamlSection keys = entry.section(kind);
  if (kind == "plane") {
    auto& plane = group.where.emplace<PlaneSelector>();
    keys.vector3("point_mm", plane.point_mm, kRequired);
    keys.vector3("normal", plane.normal, kRequired);
    keys.number("tolerance_mm", plane.tolerance_mm, kRequired);
  } else if (kind == "box") {
    auto& box = group.where.emplace<BoxSelector>();
    keys.vector3("min_mm", box.min_mm, kRequired);
    keys.vector3("max_mm", box.max_mm, kRequired);
  } else if (kind == "sphere") {
    auto& sphere = group.where.emplace<SphereSelector>();
    keys.vector3("centre_mm", sphere.centre_mm, kRequired);
    keys.number("radius_mm", sphere.radius_mm, kRequired);
    keys.number("tolerance_mm", sphere.tolerance_mm, kRequired);
  }
  keys.done();
}

void read_material(YamlSection& keys, MaterialSpec& material) {
  optional_number(keys, "youngs_modulus_pa", material.youngs_modulus_pa);
  optional_number(keys, "shear_modulus_pa", material.shear_modulus_pa);
  keys.number("poisson_ratio", material.poisson_ratio, kRequired);
  keys.number("density_kg_m3", material.density_kg_m3);
  keys.number("biot_coefficient", material.biot_coefficient);
  keys.number("storage_per_pa", material.storage_per_pa);
  keys.number("permeability_m3_s_kg", material.permeability_m3_s_kg);
}

void read_condition(YamlSection& keys, ConditionSpec& condition) {
  keys.text("on", condition.on, kRequired);
  if (keys.has("displacement_mm")) {
    Vec3 all = Vec3::Zero();
    keys.vector3("displacement_mm", all);
    condition.displacement_mm = {all[0], all[1], all[2]};
  } else {
    optional_number(keys, "displacement_x_mm", condition.displacement_mm[0]);
    optional_number(keys, "displacement_y_mm", condition.displacement_mm[1]);
    optional_number(keys, "displacement_z_mm", condition.displacement_mm[2]);
  }
  optional_number(keys, "normal_displacement_mm", condition.normal_displacement_mm);
  if (keys.has("traction_pa")) keys.vector3("traction_pa", condition.traction_pa.emplace());
  optional_number(keys, "pressure_pa", condition.pressure_pa);
  optional_number(keys, "pore_pressure_pa", condition.pore_pressure_pa);
}

void read_contact(YamlSection& entry, ContactSpec& contact) {
  entry.text("on", contact.on, kRequired);
  const std::string kind = entry.one_of({"plane", "sphere", "surface"}, kRequired);
  if (kind == "surface") {
    entry.path("surface", contact.obstacle.emplace<SurfaceObstacleSpec>().file, kRequired);
  } else if (kind == "plane") {
    auto& plane = contact.obstacle.emplace<PlaneObstacleSpec>();
    YamlSection keys = entry.section(kind);
    keys.vector3("point_mm", plane.point_mm, kRequired);
    keys.vector3("normal", plane.normal, kRequired);
    keys.done();
  } else if (kind == "sphere") {
    auto& sphere = contact.obstacle.emplace<SphereObstacleSpec>();
    YamlSection keys = entry.section(kind);
    keys.vector3("centre_mm", sphere.centre_mm, kRequired);
    keys.number("radius_mm", sphere.radius_mm, kRequired);
    keys.done();
  }
  optional_number(entry, "penalty_pa_per_mm", contact.penalty_pa_per_mm);
}

// Every key of a problem file.
void read_keys(YamlSection& root, ProblemSpec& problem) {
  YamlSection mesh = root.section("mesh", kRequired);
  mesh.path("file", problem.mesh, kRequired);
  if (mesh.has("element")) mesh.choice("element", problem.element, {"p1", "p2"});
  mesh.done();
  read_named(root.section("groups"), problem.groups, read_group);
  read_named(root.section("materials", kRequired), problem.materials, read_material);
  YamlSection regions = root.section("regions", kRequired);
  for (const std::string& region : regions.names()) {
    std::string material;
    regions.text(region, material, kRequired);
    problem.regions.emplace_back(region, material);
  }
  YamlSection body = root.section("body");
  body.vector3("gravity_m_s2", problem.gravity_m_s2);
  body.vector3("force_n_m3", problem.body_force_n_m3);
  body.done();
  read_named(root.section("conditions"), problem.conditions, read_condition);
  read_named(root.section("contact"), problem.contact, read_contact);
  if (root.has("time")) {
    YamlSection time = root.section("time", kRequired);
    time.numbers("steps_s", problem.time.emplace().steps_s, kRequired);
    time.done();
  }
  YamlSection probes = root.section("probes");
  for (const std::string& name : probes.names()) {
    ProbeSpec probe{name, Vec3::Zero()};
    probes.vector3(name, probe.at_mm, kRequired);
    problem.probes.push_back(std::move(probe));
  }
}

}  // namespace

Result<ProblemSpec> parse_problem(const std::string& text, const fs::path& file) {
  const auto check = [](const ProblemSpec& problem) { return brainshift::validate(problem); };
  auto problem = parse_yaml<ProblemSpec>(text, file, read_keys, check);
  if (problem) problem->file = fs::absolute(file).lexically_normal();
  return problem;
}

Error locate_in_problem(const fs::path& path, const Error& error) {
  const Result<std::string> text = read_file(path);
  if (!text) return {error.code, path.string() + ": " + error.message};
  YamlDocument document = YamlDocument::parse(*text, path);
  YamlSection root = document.root();
  ProblemSpec ignored;
  read_keys(root, ignored);
  return document.locate(error);
}

Result<ProblemSpec> read_problem(const fs::path& path) {
  return read_file(path).and_then(
      [&](const std::string& text) { return parse_problem(text, path); });
}

}  // namespace brainshift::io
