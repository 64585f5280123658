// SPDX-License-Identifier: GPL-3.0-or-later
// Truths of heads with slits and cavities: a box of 60 mm with a slit above and a cavity in it.
#include "tests/surgeries/outside/cavity.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "client/tools/twin/sheets.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/slit_mesh.hpp"
#include "common/geometry/surface.hpp"
#include "common/values/model_id.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/surgeries/outside/outside_truth.hpp"

namespace brainshift::outside {
namespace {

// The toy patient, open between x < 30 and x > 30 mm above z = 40 mm, with a cavity of 20 x 20 x 20
// mm about (30, 30, 20).
BrainModel box_with_anatomy() {
  BrainModel toy = test_support::toy_patient(6);
  const TetMesh mesh = toy.mesh;
  std::vector<char> taken;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const Vec3 x = mesh.nodes(Eigen::all, mesh.tets.col(t)).rowwise().mean();
    taken.push_back((x - Vec3(30, 30, 20)).cwiseAbs().cwiseQuotient(Vec3(10, 10, 10)).maxCoeff() <
                    1);
  }
  std::set<std::array<int, 3>> facets;
  for (const geometry::MeshFace& face : geometry::sorted_faces(mesh.tets)) {
    const auto in_plane = [&](int n) {
      return mesh.nodes(0, n) == 30.0 && mesh.nodes(2, n) >= 40.0;
    };
    if (std::all_of(face.nodes.begin(), face.nodes.end(), in_plane)) facets.insert(face.nodes);
  }
  const geometry::Facets slit(facets.begin(), facets.end());
  const geometry::SlitMesh cut =
      geometry::cut_mesh(mesh, taken, slit, std::vector<int>(slit.size(), 0));
  for (auto* set : {&toy.craniotomy, &toy.brainstem, &toy.slaves, &toy.fixed}) {
    std::vector<NodeIndex> now;
    for (const NodeIndex node : *set) {
      const auto& copies = cut.copies[static_cast<std::size_t>(node)];
      now.insert(now.end(), copies.begin(), copies.end());
    }
    std::sort(now.begin(), now.end());
    *set = now;
  }
  toy.mesh = cut.mesh;
  toy.boundary_triangles = cut.outer;
  toy.ventricle_wall = cut.wall;
  toy.septa = {cut.side_nodes, cut.side_normals, 0.5, cut.sheets};
  toy.model_id = content_hash(toy);
  return toy;
}

const BrainModel& box_head() {
  static const BrainModel model = box_with_anatomy();
  return model;
}

OutsideTruths& box_truths() {
  static const auto made =
      value_or_fail(OutsideTruths::make(box_head(), test_support::toy_config()));
  return *made;
}

constexpr double kCavity_mm3 = 20.0 * 20.0 * 20.0;

TEST(Cavity, ItsVolumeFollowsTheWall) {
  for (const auto element : {fem::Element::kP1, fem::Element::kP2}) {
    const fem::DisplacementSpace space = fem::make_space(box_head().mesh, element);
    const Points rest = Points::Zero(3, space.num_nodes());
    const Points shrunk = (space.nodes.colwise() - Vec3(30, 30, 20)) * -0.1;
    const Wall& wall = box_head().ventricle_wall;
    EXPECT_NEAR(cavity_volume(space, rest, wall), kCavity_mm3, 1e-8);
    EXPECT_NEAR(cavity_volume(space, shrunk, wall), kCavity_mm3 * 0.729, 1e-8);
    EXPECT_NEAR(cavity_loss(space, shrunk, wall), 0.271, 1e-12);
    for (const double sign : {-1.0, 1.0}) {
      EXPECT_NEAR(cavity_volume(space, rest, wall, {30.0, sign}), 0.5 * kCavity_mm3, 1e-8);
      EXPECT_NEAR(cavity_loss(space, shrunk, wall, {30.0, sign}), 0.271, 1e-12);
    }
  }
}

// A closed wall: no net force; and the work of the suction is that of the volume that it takes.
TEST(Cavity, SuctionDoesTheWorkOfTheVolume) {
  const fem::DisplacementSpace space = fem::make_space(box_head().mesh, fem::Element::kP2);
  const Points load = suction_load(space, box_head().ventricle_wall, {}, 2.0);
  EXPECT_LT(load.rowwise().sum().norm(), 1e-9);
  const Points little = (space.nodes.colwise() - Vec3(30, 30, 20)) * -1e-3;
  EXPECT_NEAR(load.cwiseProduct(little).sum(), 2.0 * 3e-3 * kCavity_mm3, 1e-6);
  const Points half = suction_load(space, box_head().ventricle_wall, {30.0, 1.0}, 2.0);
  for (int i = 0; i < space.num_nodes(); ++i) {
    if (space.nodes(0, i) >= 30.0) continue;
    EXPECT_EQ(half.col(i).norm(), 0.0);
  }
  EXPECT_GT(half.norm(), 0.1);
}

TEST(HeadsWithAnatomy, DrainedVentriclesLoseWhatWasDrawn) {
  ASSERT_TRUE(box_truths().head().has_cavities());
  const OutsideTruth truth = value_or_fail(box_truths().make(*find_kind("ventricles-drain"), 3));
  const double loss = truth.volume_loss;
  EXPECT_GT(loss, 0.29);
  EXPECT_LT(loss, 0.72);
  ASSERT_EQ(truth.quadratic.cols(), box_truths().head().space().num_nodes());
}

// No side passes its sheet by more than its gap, and air on one side presses some against it.
TEST(HeadsWithAnatomy, SheetsHoldBothSides) {
  const OutsideHead& head = box_truths().head();
  ASSERT_TRUE(head.has_sheets());
  const auto sides = client::sheet_nodes(head.mesh->model.septa, head.space());
  ASSERT_GT(sides.size(), 40u);
  ContactBody body = value_or_fail(
      ContactBody::make(head.space(), tissue_of(head, {}, 3), supports_of(head, {}, 3)));
  const Points load =
      20.0 * weight_load(head.space(), Vec3::UnitX(), [](const Vec3& x) { return x[0] < 30.0; });
  const Points held = value_or_fail(body.solve(load, body.gaps())).displacement;
  VecX open = body.gaps();
  open.tail(static_cast<Eigen::Index>(sides.size())).setConstant(kNoWall);
  const Points free = value_or_fail(body.solve(load, open)).displacement;
  double most = 0.0, unheld = 0.0;
  for (const client::SheetNode& side : sides) {
    most = std::max(most, side.normal.dot(held.col(side.node)));
    unheld = std::max(unheld, side.normal.dot(free.col(side.node)));
  }
  EXPECT_LE(most, 1.2 + 1e-7);
  EXPECT_GE(most, 0.2);
  EXPECT_GT(unheld, 2.0);
}

// The middle of the cavity is a node of the mesh without one.
TEST(HeadsWithAnatomy, AMeshWithoutTheirCavitiesIsOfTheSameHead) {
  const auto other = client::make_other_mesh(test_support::toy_patient(6), box_head());
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_NEAR((*other)->nodes.farthest_outside_mm(), 10.0, 1e-9);
  BrainModel shifted = test_support::toy_patient(6);
  shifted.mesh.nodes.row(0).array() += 6.0;
  EXPECT_FALSE(client::make_other_mesh(shifted, box_head()));
}

TEST(HeadsWithAnatomy, NodesOfASheetAreLocatedOnTheirSide) {
  const Points moved = client::nodes_in_their_sides(box_head());
  const fem::DisplacementSpace space = fem::make_space(box_head().mesh, fem::Element::kP1);
  const auto sides = client::sheet_nodes(box_head().septa, space);
  ASSERT_EQ(sides.size(), box_head().septa.slaves.size());
  for (const client::SheetNode& side : sides) {
    EXPECT_NEAR(std::abs(side.normal[0]), 1.0, 1e-12);
    EXPECT_NEAR(moved(0, side.node), 30.0 - 3.0 * side.normal[0], 1e-12);
  }
  // Its own displacement is that of its own side, in a mesh with the same sheets.
  const OutsideHead& head = box_truths().head();
  Points apart = Points::Zero(3, head.space().num_nodes());
  for (int e = 0; e < head.space().num_elements(); ++e) {
    const Vec3 x =
        head.space().mesh.nodes(Eigen::all, head.space().mesh.tets.col(e)).rowwise().mean();
    for (int k = 0; k < head.space().nodes_per_element(); ++k) {
      if (x[2] > 50.0) apart(0, head.space().elements(k, e)) = x[0] < 30.0 ? -1.0 : 1.0;
    }
  }
  const Points at_nodes = head.mesh->nodes.displacement(head.space(), apart);
  int seen = 0;
  for (const client::SheetNode& side : sides) {
    if (box_head().mesh.nodes(2, side.node) < 60.0) continue;
    EXPECT_NEAR(at_nodes(0, side.node), -side.normal[0], 1e-9);
    ++seen;
  }
  EXPECT_GE(seen, 6);
}

}  // namespace
}  // namespace brainshift::outside
