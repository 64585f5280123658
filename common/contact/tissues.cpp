// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/tissues.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "common/geometry/closest_point.hpp"

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

}  // namespace

Result<fem::MaterialMap> tissue_map(const BrainModel& model, const Material& material) {
  const TetMesh& mesh = model.mesh;
  auto map = fem::MaterialMap::uniform(fem::poro_material_from(material), mesh.num_tets());
  const std::set<int> labels(mesh.labels.begin(), mesh.labels.end());
  for (const auto& [label, tissue] : material.regions) {
    if (labels.count(label) == 0) {
      return fail(ErrorCode::kInvalidArgument,
                  "material.regions." + std::to_string(label) +
                      ": the mesh has no such label (there: " + listed(labels) + ")");
    }
    const auto index = static_cast<int>(map.materials.size());
    map.materials.push_back(with_stiffness(material, tissue));
    for (std::size_t t = 0; t < mesh.labels.size(); ++t) {
      if (mesh.labels[t] == label) map.of_tet[t] = index;
    }
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

}  // namespace brainshift::contact
