// SPDX-License-Identifier: GPL-3.0-or-later
// Slits with a fixed sheet: two blocks of 30 mm on either side of the plane x = 30 mm.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "common/contact/forward_model.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/slit_mesh.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::contact {
namespace {

constexpr double kShear = 2100e-6, kPoisson = 0.4, kStiff = 1e6;  // N/mm^2, -, N/mm

BrainModel blocks(double gap_mm) {
  const TetMesh mesh = test_support::box_mesh(4, 3, 3, Vec3(60, 30, 30));
  geometry::Facets facets;
  for (const auto& face : geometry::sorted_faces(mesh.tets)) {
    bool in_plane = true;
    for (const int n : face.nodes) in_plane = in_plane && mesh.nodes(0, n) == 30.0;
    if (in_plane && (facets.empty() || facets.back() != face.nodes)) facets.push_back(face.nodes);
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

// Which block a node belongs to: -1 left, 1 right.
std::vector<int> sides_of(const TetMesh& mesh) {
  std::vector<int> sides(static_cast<std::size_t>(mesh.num_nodes()));
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const double centre = mesh.nodes.row(0)(mesh.tets.col(t)).mean();
    for (const int n : mesh.tets.col(t))
      sides[static_cast<std::size_t>(n)] = centre > 30.0 ? 1 : -1;
  }
  return sides;
}

// Rollers on the faces x = 0, x = 60, y = 0 and z = 0.
ForwardModel on_rollers(const BrainModel& model) {
  fem::DofMap dofs(model.mesh.num_nodes());
  for (int n = 0; n < model.mesh.num_nodes(); ++n) {
    const Vec3 x = model.mesh.nodes.col(n);
    if (x[0] == 60.0 || x[0] == 0.0) dofs.fix_component(n, 0);
    for (const int axis : {1, 2})
      if (x[axis] == 0.0) dofs.fix_component(n, axis);
  }
  dofs.finalise();
  Material material;
  material.shear_modulus_pa = 1e6 * kShear;
  material.poisson_ratio = kPoisson;
  const auto tissue =
      fem::MaterialMap::uniform(fem::poro_material_from(material), model.mesh.num_tets());
  return value_or_fail(ForwardModel::assemble(
      fem::make_space(model.mesh, fem::Element::kP1), tissue, std::move(dofs),
      PenaltyContact(value_or_fail(contact_pairs(model)), kStiff)));
}

Points equilibrium(const ForwardModel& forward, const Points& load) {
  RefactorisedSystem system(forward);
  EXPECT_TRUE(system.activate(ActiveSet(forward.contact().pairs().size(), 1)).has_value());
  Points u;
  EXPECT_TRUE(system.solve_with_gaps(load, u).has_value());
  for (int i = 0; i < 50; ++i) {
    const auto changed = system.follow_contact(load, u);
    EXPECT_TRUE(changed.has_value());
    if (!changed || !*changed) return u;
  }
  ADD_FAILURE() << "contact does not settle";
  return u;
}

// A sheet that is too thick by 0.3 mm on either side presses each block into uniform uniaxial
// stress.
TEST(Septa, ASheetThatPressesGivesUniformStress) {
  const BrainModel model = blocks(-0.3);
  const ForwardModel forward = on_rollers(model);
  const Points u = equilibrium(forward, Points::Zero(3, model.mesh.num_nodes()));
  const std::vector<int> sides = sides_of(model.mesh);
  constexpr double kStrain = 0.3 / 30.0;
  for (int n = 0; n < model.mesh.num_nodes(); ++n) {
    const Vec3 x = model.mesh.nodes.col(n);
    const double along = sides[static_cast<std::size_t>(n)] < 0 ? -x[0] : 60.0 - x[0];
    const Vec3 expected = kStrain * Vec3(along, kPoisson * x[1], kPoisson * x[2]);
    EXPECT_LT((u.col(n) - expected).norm(), 1e-5 * 0.3) << x.transpose();
  }
  EXPECT_LT(forward.contact().penetration(u).maxCoeff(), 1e-5 * 0.3);
}

TEST(Septa, BlocksThatArePulledApartCarryNothingAcross) {
  const BrainModel model = blocks(0.3);
  const ForwardModel forward = on_rollers(model);
  // Both are drawn away from the sheet by their own weight.
  Points load = Points::Zero(3, model.mesh.num_nodes());
  const std::vector<int> sides = sides_of(model.mesh);
  const VecX volumes = fem::nodal_volumes(model.mesh);
  for (int n = 0; n < model.mesh.num_nodes(); ++n)
    load(0, n) = sides[static_cast<std::size_t>(n)] * 1e-5 * volumes[n];
  const Points u = equilibrium(forward, load);
  EXPECT_EQ(count(forward.contact().penetrating(u)), 0);
  // Each is a column of its own: its free end moves by f L^2 / 2 E, in the mean over its few nodes.
  const double end = 1e-5 * 30.0 * 30.0 / 2.0 / (2.0 * kShear * (1.0 + kPoisson));
  double mean = 0.0;
  for (const NodeIndex node : model.septa.slaves) {
    const double out = sides[static_cast<std::size_t>(node)] * u(0, node);
    EXPECT_GT(out, 0.0);
    mean += out / static_cast<double>(model.septa.slaves.size());
  }
  EXPECT_NEAR(mean, end, 0.1 * end);
}

TEST(Septa, TissueMovesFreelyWithinTheGapAndStopsThere) {
  const BrainModel model = blocks(0.5);
  const ForwardModel forward = on_rollers(model);
  Points load = Points::Zero(3, model.mesh.num_nodes());
  const std::vector<int> sides = sides_of(model.mesh);
  const VecX volumes = fem::nodal_volumes(model.mesh);
  for (int n = 0; n < model.mesh.num_nodes(); ++n)
    if (sides[static_cast<std::size_t>(n)] < 0) load(0, n) = 5e-5 * volumes[n];
  const Points u = equilibrium(forward, load);
  EXPECT_GT(count(forward.contact().penetrating(u)), 0);
  double most = 0.0;
  for (const NodeIndex node : model.septa.slaves) {
    most = std::max(most, u(0, node));
    if (sides[static_cast<std::size_t>(node)] > 0) {
      EXPECT_LT(u.col(node).norm(), 1e-12);
    }
  }
  EXPECT_NEAR(most, 0.5, 1e-3);
}

TEST(Septa, UnderTheFixedBoundaryNoSideMovesAlongTheNormal) {
  BrainModel model = blocks(0.5);
  for (int n = 0; n < model.mesh.num_nodes(); ++n)
    if (model.mesh.nodes(2, n) == 0.0 && model.mesh.nodes(0, n) != 30.0) model.fixed.push_back(n);
  CaseConfig config;
  const auto forward = value_or_fail(ForwardModel::build(model, config, Boundary::kFixed));
  std::srand(5);
  Points u;
  ASSERT_TRUE(forward.solve(Points::Random(3, model.mesh.num_nodes()), u).has_value());
  double slides = 0.0;
  for (std::size_t i = 0; i < model.septa.slaves.size(); ++i) {
    const auto moved = u.col(model.septa.slaves[i]);
    EXPECT_NEAR(moved.dot(model.septa.normals.col(static_cast<Eigen::Index>(i))), 0.0, 1e-9);
    slides = std::max(slides, moved.norm());
  }
  EXPECT_GT(slides, 1e-3);
}

}  // namespace
}  // namespace brainshift::contact
