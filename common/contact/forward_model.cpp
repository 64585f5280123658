// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/forward_model.hpp"

#include <set>
#include <string>
#include <utility>

#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"
#include "common/fem/space_elasticity.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::contact {
namespace {

fem::PoroMaterial with_stiffness(const Material& material, const TissueStiffness& tissue) {
  Material changed = material;
  changed.shear_modulus_pa = tissue.shear_modulus_pa;
  changed.poisson_ratio = tissue.poisson_ratio;
  return fem::poro_material_from(changed);
}

std::string listed(const std::set<int>& labels) {
  std::string text;
  for (const int label : labels) text += (text.empty() ? "" : ", ") + std::to_string(label);
  return text.empty() ? "none" : text;
}

// Average nodal normals of the boundary, 3 x n; zero at interior nodes.
Points boundary_normals(const BrainModel& model) {
  return geometry::vertex_normals({model.mesh.nodes, model.boundary_triangles});
}

// As slaves of the skull are; those that are slaves of it too, or of another sheet, keep that
// normal.
void fix_along_septa(const BrainModel& model, fem::DofMap& dofs) {
  std::set<NodeIndex> held(model.slaves.begin(), model.slaves.end());
  for (std::size_t i = 0; i < model.septa.slaves.size(); ++i) {
    if (!held.insert(model.septa.slaves[i]).second) continue;
    dofs.fix_normal(model.septa.slaves[i], model.septa.normals.col(static_cast<Eigen::Index>(i)));
  }
}

fem::DofMap constrain(const BrainModel& model, Boundary boundary) {
  const Points normals = boundary_normals(model);
  fem::DofMap dofs(model.mesh.num_nodes());
  for (NodeIndex node : model.fixed) dofs.fix_normal(node, normals.col(node));
  if (boundary == Boundary::kFixed) {
    for (NodeIndex node : model.slaves) dofs.fix_normal(node, normals.col(node));
    fix_along_septa(model, dofs);
  }
  dofs.finalise();
  return dofs;
}

Result<fem::StiffnessFactor> factorise(const BrainModel& model, const CaseConfig& config,
                                       const fem::MaterialMap& materials, const fem::DofMap& dofs,
                                       const linalg::SymmetricMatrix& stiffness,
                                       const SharedNodes& shared) {
  if (shared.ranks != nullptr) {
    if (config.scene.pressure == Carry::kOn) {
      return invalid("scene.pressure = on: a model with pressure is prepared by one process");
    }
    std::vector<int> part(static_cast<std::size_t>(dofs.num_unknowns()));
    for (int node = 0; node < dofs.num_nodes(); ++node) {
      for (int axis = 0; axis < 3; ++axis) {
        const int unknown = dofs.unknown(node, axis);
        if (unknown < 0) continue;
        part[static_cast<std::size_t>(unknown)] = shared.part[static_cast<std::size_t>(node)];
      }
    }
    auto parts = linalg::DistributedCholesky::factorise(stiffness, part, *shared.ranks);
    if (!parts) return tl::unexpected(parts.error());
    return fem::StiffnessFactor(std::move(*parts));
  }
  if (config.scene.pressure != Carry::kOn) {
    auto drained = linalg::SparseCholesky::factorise(stiffness);
    if (!drained) return tl::unexpected(drained.error());
    return fem::StiffnessFactor(std::move(*drained));
  }
  const Eigen::Matrix3Xi& triangles = model.boundary_triangles;
  const std::vector<NodeIndex> drained(triangles.data(), triangles.data() + triangles.size());
  auto step = fem::BiotFactor::factorise(fem::assemble_biot(
      model.mesh, materials, dofs, fem::PressureMap(model.mesh.num_nodes(), drained),
      config.scene.pressure_step_s));
  if (!step) return tl::unexpected(step.error());
  return fem::StiffnessFactor(std::move(*step));
}

}  // namespace

Result<std::vector<ContactPair>> contact_pairs(const BrainModel& model) {
  auto pairs = search_contact(model.mesh.nodes, model.slaves, model.skull);
  if (!pairs) return pairs;
  const Septa& septa = model.septa;
  for (std::size_t i = 0; i < septa.slaves.size(); ++i) {
    const Vec3 normal = septa.normals.col(static_cast<Eigen::Index>(i));
    const Vec3 sheet = model.mesh.nodes.col(septa.slaves[i]) - septa.gap_mm * normal;
    pairs->push_back({septa.slaves[i], sheet, normal, -septa.gap_mm});
  }
  return pairs;
}

Result<fem::MaterialMap> tissue_map(const BrainModel& model, const Material& material) {
  const TetMesh& mesh = model.mesh;
  auto map = fem::MaterialMap::uniform(fem::poro_material_from(material), mesh.num_tets());
  const std::set<int> labels(mesh.labels.begin(), mesh.labels.end());
  const auto add = [&](int label, const TissueStiffness& tissue) {
    const auto index = static_cast<int>(map.materials.size());
    map.materials.push_back(with_stiffness(material, tissue));
    for (std::size_t t = 0; t < mesh.labels.size(); ++t) {
      if (mesh.labels[t] == label) map.of_tet[t] = index;
    }
  };
  const std::pair<int, double> told[] = {{kWhiteMatter, material.tissues.white_matter},
                                         {kGreyMatter, material.tissues.grey_matter},
                                         {kCerebellumLabel, material.tissues.cerebellum},
                                         {kBrainstemLabel, material.tissues.brainstem}};
  for (const auto& [label, ratio] : told) {
    if (labels.count(label) == 0) continue;
    add(label, {ratio * material.shear_modulus_pa, material.poisson_ratio});
  }
  for (const auto& [label, tissue] : material.regions) {
    if (labels.count(label) == 0) {
      return invalid("material.regions." + std::to_string(label) +
                     ": the mesh has no such label (there: " + listed(labels) + ")");
    }
    add(label, tissue);
  }
  if (!material.tumour) return map;
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  if (!tumour) return tl::unexpected(tumour.error());
  const auto index = static_cast<int>(map.materials.size());
  map.materials.push_back(with_stiffness(material, *material.tumour));
  bool found = false;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centre += 0.25 * mesh.nodes.col(mesh.tets(k, t));
    if (!tumour->contains(centre)) continue;
    map.of_tet[static_cast<std::size_t>(t)] = index;
    found = true;
  }
  if (found) return map;
  return fail(ErrorCode::kEmptySet,
              "material.tumour: no tetrahedron has its centre inside the tumour; refine the mesh "
              "there (mesh.generate.tumour_edge_mm)");
}

ForwardModel::ForwardModel(Boundary boundary, fem::DofMap dofs,
                           const linalg::SymmetricMatrix& stiffness, fem::StiffnessFactor factor,
                           PenaltyContact contact, double assemble_s)
    : boundary_(boundary),
      dofs_(std::move(dofs)),
      stiffness_(stiffness),
      stiffness_norm_(linalg::max_norm(stiffness_)),
      factor_(std::move(factor)),
      contact_(std::move(contact)),
      assemble_s_(assemble_s) {}

Result<ForwardModel> ForwardModel::build(const BrainModel& model, const CaseConfig& config,
                                         Boundary boundary, const Progress& progress,
                                         const SharedNodes& shared) {
  const Stopwatch watch;
  report(progress, "assemble", 0.0);
  fem::DofMap dofs = constrain(model, boundary);
  const auto materials = tissue_map(model, config.material);
  if (!materials) return tl::unexpected(materials.error());
  linalg::SymmetricMatrix stiffness =
      fem::assemble_stiffness(model.mesh, materials->elastic(), dofs);
  const double assemble_s = watch.seconds();

  std::vector<ContactPair> pairs;
  if (boundary == Boundary::kContact) {
    report(progress, "contact search", 0.0);
    auto found = contact_pairs(model);
    if (!found) return tl::unexpected(found.error());
    pairs = std::move(*found);
  }
  report(progress, "factorise", 0.0);
  auto factor = factorise(model, config, *materials, dofs, stiffness, shared);
  if (!factor) return tl::unexpected(factor.error());
  report(progress, "factorise", 1.0);
  return ForwardModel(boundary, std::move(dofs), stiffness, std::move(*factor),
                      PenaltyContact(std::move(pairs), config.contact.penalty_n_per_mm),
                      assemble_s);
}

Result<ForwardModel> ForwardModel::assemble(const fem::DisplacementSpace& space,
                                            const fem::MaterialMap& materials, fem::DofMap dofs,
                                            PenaltyContact contact, const Progress& progress) {
  const Stopwatch watch;
  report(progress, "assemble", 0.0);
  const linalg::SymmetricMatrix stiffness = fem::assemble_stiffness(space, materials, dofs);
  const double assemble_s = watch.seconds();
  report(progress, "factorise", 0.0);
  auto factor = linalg::SparseCholesky::factorise(stiffness);
  if (!factor) return tl::unexpected(factor.error());
  report(progress, "factorise", 1.0);
  return ForwardModel(Boundary::kContact, std::move(dofs), stiffness,
                      fem::StiffnessFactor(std::move(*factor)), std::move(contact), assemble_s);
}

std::uint64_t ForwardModel::bytes() const {
  return factor_.bytes() +
         static_cast<std::uint64_t>(stiffness_.nonZeros()) * (sizeof(double) + sizeof(long));
}

Status ForwardModel::solve(const Points& load, Points& u) const {
  VecX unknowns;
  const auto quality =
      fem::checked_solve(stiffness_, stiffness_norm_, factor_, dofs_.restrict_to(load), unknowns);
  if (!quality) return tl::unexpected(quality.error());
  dofs_.expand(unknowns, u);
  return {};
}

Points ForwardModel::solve(const Points& load) const {
  return dofs_.expand(factor_.solve(dofs_.restrict_to(load)));
}

double measure_full_solve_ms(const ForwardModel& forward) {
  constexpr int kRepetitions = 9;
  const VecX b = VecX::LinSpaced(forward.dofs().num_unknowns(), -1.0, 1.0);
  VecX x = forward.factor().solve(b);  // allocates the workspace
  std::vector<double> times_ms;
  for (int i = 0; i < kRepetitions; ++i) {
    const Stopwatch watch;
    forward.factor().solve(b, x);
    times_ms.push_back(watch.milliseconds());
  }
  return percentile(times_ms, 50.0);
}

}  // namespace brainshift::contact
