// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/slit_block.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "common/contact/penalised_system.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/slit_mesh.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::test_support {

BrainModel slit_block(const std::array<int, 3>& cells, double gap_mm, double from_mm) {
  const TetMesh mesh = box_mesh(cells[0], cells[1], cells[2], Vec3(60, 30, 30));
  geometry::Facets facets;
  for (const auto& face : geometry::sorted_faces(mesh.tets)) {
    bool opened = true;
    for (const int n : face.nodes) {
      opened = opened && mesh.nodes(0, n) == kSlitPlane_mm && mesh.nodes(2, n) >= from_mm;
    }
    if (opened && (facets.empty() || facets.back() != face.nodes)) facets.push_back(face.nodes);
  }
  auto cut =
      geometry::cut_mesh(mesh, std::vector<char>(static_cast<std::size_t>(mesh.num_tets()), 0),
                         facets, std::vector<int>(facets.size(), 0));
  BrainModel model;
  model.skull = geometry::boundary_surface(mesh);
  model.mesh = std::move(cut.mesh);
  model.boundary_triangles = std::move(cut.outer);
  model.septa.slaves = std::move(cut.side_nodes);
  model.septa.normals = std::move(cut.side_normals);
  model.septa.gap_mm = gap_mm;
  return model;
}

std::vector<int> sides_of(const TetMesh& mesh) {
  std::vector<int> sides(static_cast<std::size_t>(mesh.num_nodes()));
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const double centre = mesh.nodes.row(0)(mesh.tets.col(t)).mean();
    for (const int n : mesh.tets.col(t))
      sides[static_cast<std::size_t>(n)] = centre > kSlitPlane_mm ? 1 : -1;
  }
  return sides;
}

bool on_roller(const Vec3& node, int axis) {
  return node[axis] == 0.0 || (axis == 0 && node[0] == 60.0);
}

Result<contact::ForwardModel> on_rollers(const BrainModel& model) {
  fem::DofMap dofs(model.mesh.num_nodes());
  for (int n = 0; n < model.mesh.num_nodes(); ++n) {
    for (const int axis : {0, 1, 2})
      if (on_roller(model.mesh.nodes.col(n), axis)) dofs.fix_component(n, axis);
  }
  dofs.finalise();
  Material material;
  material.shear_modulus_pa = 1e6 * kSlitShear;
  material.poisson_ratio = kSlitPoisson;
  const auto tissue =
      fem::MaterialMap::uniform(fem::poro_material_from(material), model.mesh.num_tets());
  auto pairs = contact::contact_pairs(model);
  if (!pairs) return tl::unexpected(pairs.error());
  return contact::ForwardModel::assemble(fem::make_space(model.mesh, fem::Element::kP1), tissue,
                                         std::move(dofs),
                                         contact::PenaltyContact(std::move(*pairs), kSlitPenalty));
}

Result<Points> equilibrium(const contact::ForwardModel& forward, const Points& load) {
  contact::RefactorisedSystem system(forward);
  const contact::ActiveSet all(forward.contact().pairs().size(), 1);
  if (auto ok = system.activate(all); !ok) return tl::unexpected(ok.error());
  Points u;
  if (auto ok = system.solve_with_gaps(load, u); !ok) return tl::unexpected(ok.error());
  for (int set = 0; set < 50; ++set) {
    const auto changed = system.follow_contact(load, u);
    if (!changed) return tl::unexpected(changed.error());
    if (!*changed) return u;
  }
  return fail(ErrorCode::kNotConverged, "slit: contact does not settle");
}

BrainModel partly_slit_block() { return slit_block({8, 6, 6}, 0.2, 10.0); }

Points load_of_partly_slit_block(const TetMesh& mesh) {
  const std::vector<int> sides = sides_of(mesh);
  const VecX volumes = fem::nodal_volumes(mesh);
  Points load(3, mesh.num_nodes());
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const double y = mesh.nodes(1, n), z = mesh.nodes(2, n);
    const double along = sides[static_cast<std::size_t>(n)] < 0
                             ? 4e-5 * std::cos(std::numbers::pi * y / 30.0)
                             : -4e-5 * std::cos(std::numbers::pi * (z - 10.0) / 20.0);
    load.col(n) = volumes[n] * Vec3(along, 0.0, -1e-5);
  }
  return load;
}

}  // namespace brainshift::test_support
