// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/forward/build_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <utility>

#include "common/core/units.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::forward {
namespace {

using Faces = Eigen::Matrix<int, 3, Eigen::Dynamic>;

// kg/m^3 x m/s^2 = N/m^3
constexpr double kForceDensity = units::force_density_from_n_m3(1.0);

std::array<int, 3> sorted(const Eigen::Vector3i& face) {
  std::array<int, 3> key = {face[0], face[1], face[2]};
  std::sort(key.begin(), key.end());
  return key;
}

std::string listed(const std::set<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

Faces matrix_of(const std::vector<Eigen::Vector3i>& list) {
  Faces faces(3, static_cast<Eigen::Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) faces.col(static_cast<Eigen::Index>(i)) = list[i];
  return faces;
}

bool selects(const PlaneSelector& plane, const Vec3& x) {
  return std::abs((x - plane.point_mm).dot(plane.normal.normalized())) <= plane.tolerance_mm;
}
bool selects(const BoxSelector& box, const Vec3& x) {
  return (x - box.min_mm).minCoeff() >= 0.0 && (box.max_mm - x).minCoeff() >= 0.0;
}
bool selects(const SphereSelector& sphere, const Vec3& x) {
  return std::abs((x - sphere.centre_mm).norm() - sphere.radius_mm) <= sphere.tolerance_mm;
}

class Builder {
 public:
  Builder(const ProblemSpec& spec, GroupedMesh mesh, const std::vector<TriangleSurface>& surfaces)
      : spec_(spec), file_(std::move(mesh)), surfaces_(surfaces) {}

  Result<ForwardProblem> build() {
    if (Status ok = geometry::check_mesh(file_.mesh); !ok) {
      return fail(ok.error().code, "mesh.file: " + ok.error().message);
    }
    if (spec_.time) problem_.steps_s = spec_.time->steps_s;
    const bool linear = spec_.element == "p1" || (spec_.element.empty() && spec_.time);
    problem_.element = linear ? fem::Element::kP1 : fem::Element::kP2;
    for (const auto step :
         {&Builder::set_materials, &Builder::set_mesh_groups, &Builder::set_selected_groups,
          &Builder::set_conditions, &Builder::set_contacts}) {
      if (Status ok = (this->*step)(); !ok) return tl::unexpected(ok.error());
    }
    problem_.mesh = std::move(file_.mesh);
    return std::move(problem_);
  }

 private:
  Status set_materials();
  Status set_mesh_groups();
  Status set_selected_groups();
  Status set_conditions();
  Status set_contacts();
  // Label of a volume group by name or number; nothing when the mesh has no such region.
  std::optional<int> label_of(const std::string& region) const;
  std::string region_names() const;
  const Faces& boundary();

  const ProblemSpec& spec_;
  GroupedMesh file_;
  const std::vector<TriangleSurface>& surfaces_;
  ForwardProblem problem_;
  Faces boundary_;
};

const Faces& Builder::boundary() {
  if (boundary_.cols() == 0) boundary_ = geometry::boundary_triangles(file_.mesh);
  return boundary_;
}

std::optional<int> Builder::label_of(const std::string& region) const {
  if (const auto named = file_.volume_names.find(region); named != file_.volume_names.end()) {
    return named->second;
  }
  int label = 0;
  const char* end = region.data() + region.size();
  const auto [stop, error] = std::from_chars(region.data(), end, label);
  if (error != std::errc() || stop != end) return std::nullopt;
  const auto& labels = file_.mesh.labels;
  if (std::find(labels.begin(), labels.end(), label) == labels.end()) return std::nullopt;
  return label;
}

std::string Builder::region_names() const {
  std::set<std::string> names;
  for (const auto& [name, label] : file_.volume_names) names.insert(name);
  std::set<int> unnamed(file_.mesh.labels.begin(), file_.mesh.labels.end());
  for (const auto& [name, label] : file_.volume_names) unnamed.erase(label);
  for (const int label : unnamed) names.insert(std::to_string(label));
  names.insert("all");
  return listed(names);
}

Status Builder::set_materials() {
  std::set<std::string> known;
  for (const MaterialSpec& material : spec_.materials) {
    known.insert(material.name);
    problem_.materials.materials.push_back(poro_material_from(material));
  }
  const int tets = file_.mesh.num_tets();
  auto& of_tet = problem_.materials.of_tet;
  of_tet.assign(static_cast<std::size_t>(tets), -1);
  const auto label = [this](std::size_t t) {
    return file_.mesh.labels.empty() ? 0 : file_.mesh.labels[t];
  };
  // "all" fills the tetrahedra that no other region claims, wherever it stands in the list.
  for (const bool all : {false, true}) {
    for (const auto& [region, material] : spec_.regions) {
      if ((region == "all") != all) continue;
      const auto found = std::find_if(spec_.materials.begin(), spec_.materials.end(),
                                      [&m = material](const auto& spec) { return spec.name == m; });
      if (found == spec_.materials.end()) {
        return invalid(fmt::format("regions.{} = {}: no such material (there: {})", region,
                                   material, listed(known)));
      }
      const auto index = static_cast<int>(found - spec_.materials.begin());
      const std::optional<int> wanted = all ? std::nullopt : label_of(region);
      if (!all && !wanted) {
        return invalid(fmt::format("regions.{}: the mesh has no such region (there: {})", region,
                                   region_names()));
      }
      for (std::size_t t = 0; t < of_tet.size(); ++t) {
        if (of_tet[t] < 0 && (all || label(t) == *wanted)) of_tet[t] = index;
      }
    }
  }
  const auto missing = std::find(of_tet.begin(), of_tet.end(), -1);
  if (missing != of_tet.end()) {
    const int bare = label(static_cast<std::size_t>(missing - of_tet.begin()));
    std::string name = std::to_string(bare);
    for (const auto& [text, number] : file_.volume_names) {
      if (number == bare) name = text;
    }
    return invalid(fmt::format("regions: region {} of the mesh has no material", name));
  }
  problem_.body_force.resize(3, tets);
  for (int t = 0; t < tets; ++t) {
    const double density =
        spec_.materials[static_cast<std::size_t>(of_tet[static_cast<std::size_t>(t)])]
            .density_kg_m3;
    problem_.body_force.col(t) =
        kForceDensity * (density * spec_.gravity_m_s2 + spec_.body_force_n_m3);
  }
  return {};
}

// The file's triangles by label, turned to look outwards.
Status Builder::set_mesh_groups() {
  if (file_.triangles.cols() == 0) return {};
  std::map<std::array<int, 3>, Eigen::Vector3i> outward;
  for (Eigen::Index f = 0; f < boundary().cols(); ++f) {
    outward.emplace(sorted(boundary().col(f)), boundary().col(f));
  }
  std::map<int, std::vector<Eigen::Vector3i>> of_label, inner;
  for (Eigen::Index f = 0; f < file_.triangles.cols(); ++f) {
    const int label = file_.triangle_labels[static_cast<std::size_t>(f)];
    const auto found = outward.find(sorted(file_.triangles.col(f)));
    if (found != outward.end()) {
      of_label[label].push_back(found->second);
    } else {
      inner[label].emplace_back(file_.triangles.col(f));
    }
  }
  const auto add = [&](const std::string& name, int label) {
    FaceGroup group{{}, matrix_of(of_label[label]), matrix_of(inner[label])};
    std::set<NodeIndex> vertices(group.faces.data(), group.faces.data() + group.faces.size());
    vertices.insert(group.inner.data(), group.inner.data() + group.inner.size());
    group.vertices.assign(vertices.begin(), vertices.end());
    problem_.groups[name] = std::move(group);
  };
  std::set<int> unnamed(file_.triangle_labels.begin(), file_.triangle_labels.end());
  for (const auto& [name, label] : file_.surface_names) {
    add(name, label);
    unnamed.erase(label);
  }
  for (const int label : unnamed) add(std::to_string(label), label);
  return {};
}

Status Builder::set_selected_groups() {
  for (const GroupSpec& spec : spec_.groups) {
    if (problem_.groups.count(spec.name) > 0) {
      return invalid(
          fmt::format("groups.{}: the mesh has a group of this name already", spec.name));
    }
    const auto selected = [&](NodeIndex node) {
      const Vec3 x = file_.mesh.nodes.col(node);
      return std::visit([&x](const auto& where) { return selects(where, x); }, spec.where);
    };
    std::vector<Eigen::Vector3i> faces;
    std::set<NodeIndex> vertices;
    for (Eigen::Index f = 0; f < boundary().cols(); ++f) {
      bool whole = true;
      for (int k = 0; k < 3; ++k) {
        if (selected(boundary()(k, f))) {
          vertices.insert(boundary()(k, f));
        } else {
          whole = false;
        }
      }
      if (whole) faces.emplace_back(boundary().col(f));
    }
    if (vertices.empty()) {
      return fail(ErrorCode::kEmptySet,
                  fmt::format("groups.{}: selects no node of the mesh's boundary", spec.name));
    }
    problem_.groups[spec.name] = {
        {vertices.begin(), vertices.end()}, matrix_of(faces), Faces(3, 0)};
  }
  return {};
}

Status Builder::set_conditions() {
  for (const ConditionSpec& spec : spec_.conditions) {
    Condition condition{spec.name, spec.on, Displacement{spec.displacement_mm}};
    if (spec.normal_displacement_mm) {
      condition.what = NormalDisplacement{*spec.normal_displacement_mm};
    } else if (spec.traction_pa) {
      Vec3 t = *spec.traction_pa * units::stress_from_pa(1.0);
      condition.what = Traction{[t](const Vec3&) { return t; }};
    } else if (spec.pressure_pa) {
      condition.what = Pressure{units::stress_from_pa(*spec.pressure_pa)};
    } else if (spec.pore_pressure_pa) {
      condition.what = PorePressure{units::stress_from_pa(*spec.pore_pressure_pa)};
    }
    problem_.conditions.push_back(std::move(condition));
  }
  return {};
}

Status Builder::set_contacts() {
  std::size_t next_surface = 0;
  for (const ContactSpec& spec : spec_.contact) {
    Contact contact{spec.name, spec.on, contact::RigidPlane{}, std::nullopt};
    if (const auto* plane = std::get_if<PlaneObstacleSpec>(&spec.obstacle)) {
      contact.obstacle = contact::RigidPlane{plane->point_mm, plane->normal.normalized()};
    } else if (const auto* sphere = std::get_if<SphereObstacleSpec>(&spec.obstacle)) {
      contact.obstacle = contact::RigidSphere{sphere->centre_mm, sphere->radius_mm};
    } else {
      contact.obstacle = contact::RigidSurface{surfaces_.at(next_surface++)};
    }
    if (spec.penalty_pa_per_mm) contact.penalty = units::stress_from_pa(*spec.penalty_pa_per_mm);
    problem_.contacts.push_back(std::move(contact));
  }
  return {};
}

}  // namespace

fem::PoroMaterial poro_material_from(const MaterialSpec& material) {
  const double nu = material.poisson_ratio;
  const double shear = units::stress_from_pa(
      material.shear_modulus_pa ? *material.shear_modulus_pa
                                : *material.youngs_modulus_pa / (2.0 * (1.0 + nu)));
  fem::PoroMaterial result;
  result.elastic = {2.0 * shear * nu / (1.0 - 2.0 * nu), shear};
  result.biot_coefficient = material.biot_coefficient;
  result.storage = material.storage_per_pa / units::stress_from_pa(1.0);
  result.permeability = units::permeability_from_m3_s_kg(material.permeability_m3_s_kg);
  return result;
}

Result<ForwardProblem> build_problem(const ProblemSpec& spec, GroupedMesh mesh,
                                     const std::vector<TriangleSurface>& surfaces) {
  return Builder(spec, std::move(mesh), surfaces).build();
}

}  // namespace brainshift::forward
