// SPDX-License-Identifier: GPL-3.0-or-later
// Truths from outside: equilibrium, walls, sheets, and what each kind moves; on the toy patient.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/core/units.hpp"
#include "common/fem/space_elasticity.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/surgeries/outside/outside_truth.hpp"

namespace brainshift::outside {
namespace {

const BrainModel& toy() {
  static const BrainModel model = test_support::toy_patient(6);
  return model;
}

const OutsideHead& toy_head() {
  static const OutsideHead head =
      value_or_fail(make_outside_head(toy(), test_support::toy_config()));
  return head;
}

// Symmetry planes at x, y, z = 0, traction on the top: u = T / E (-nu x, -nu y, z).
TEST(ContactBody, StrainsEvenlyUnderEvenTraction) {
  const TetMesh mesh = test_support::box_mesh(Vec3::Zero(), Vec3::Constant(20.0), 2, 0.1);
  const fem::DisplacementSpace space = fem::make_space(mesh, fem::Element::kP2);
  const Material material;
  Supports supports{fem::DofMap(space.num_nodes()), {}, {}};
  for (int node = 0; node < space.num_nodes(); ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      if (space.nodes(axis, node) == 0.0) supports.dofs.fix_component(node, axis);
    }
  }
  supports.dofs.finalise();
  const auto tissue =
      fem::MaterialMap::uniform(fem::poro_material_from(material), space.num_elements());
  auto body = value_or_fail(ContactBody::make(space, tissue, supports));
  std::vector<Eigen::Vector3i> top;
  for (int e = 0; e < space.num_elements(); ++e) {
    for (int skip = 0; skip < 4; ++skip) {
      std::vector<int> face;
      for (int k = 0; k < 4; ++k) {
        if (k != skip) face.push_back(mesh.tets(k, e));
      }
      if (std::all_of(face.begin(), face.end(), [&](int v) { return mesh.nodes(2, v) == 20.0; })) {
        top.emplace_back(face[0], face[1], face[2]);
      }
    }
  }
  Eigen::Matrix<int, 3, Eigen::Dynamic> faces(3, static_cast<Eigen::Index>(top.size()));
  for (std::size_t f = 0; f < top.size(); ++f) faces.col(static_cast<Eigen::Index>(f)) = top[f];
  const double traction = 1e-4;
  const Points load = fem::traction_load(
      space, faces, [&](const Vec3&) -> Vec3 { return traction * Vec3::UnitZ(); });
  const auto rest = value_or_fail(body.solve(load, body.gaps()));
  const double modulus =
      units::stress_from_pa(2.0 * material.shear_modulus_pa * (1.0 + material.poisson_ratio));
  const Vec3 strain =
      traction / modulus * Vec3(-material.poisson_ratio, -material.poisson_ratio, 1.0);
  const Points exact = strain.asDiagonal() * space.nodes;
  EXPECT_GT(exact.maxCoeff(), 0.2);
  EXPECT_LT((rest.displacement - exact).cwiseAbs().maxCoeff(), 1e-9);
}

class OnTheToy : public testing::Test {
 protected:
  // Half of the load lifts and half presses aside, so that walls push and others part.
  OnTheToy() {
    const Vec3 way = Vec3(0.7, 0.2, 0.5).normalized();
    load = 3.0 * weight_load(head.space(), way, [](const Vec3&) { return true; });
  }
  const OutsideHead& head = toy_head();
  ContactBody body = value_or_fail(
      ContactBody::make(head.space(), tissue_of(head, {}, 3), supports_of(head, {}, 3)));
  Points load;
};

TEST_F(OnTheToy, ForcesBalanceAtEveryNode) {
  const auto rest = value_or_fail(body.solve(load, body.gaps()));
  const Points left = body.internal_force(rest.displacement) - load - body.push(rest.pressing_n);
  EXPECT_LT(left.cwiseAbs().maxCoeff(), 1e-8 * load.cwiseAbs().maxCoeff());
}

// Signorini: no side is deeper than its gap, none pulls, and what presses touches.
TEST_F(OnTheToy, WallsHoldAndDoNotPull) {
  const VecX gaps = body.gaps();
  ASSERT_GT(gaps.size(), 100);
  EXPECT_GE(gaps.minCoeff(), 0.3);
  EXPECT_LE(gaps.maxCoeff(), 2.5);
  const auto rest = value_or_fail(body.solve(load, gaps));
  const VecX free = gaps - body.outward(rest.displacement);
  const auto pressed = (rest.pressing_n.array() > 0.0).count();
  EXPECT_GT(pressed, 5);
  EXPECT_LT(pressed, gaps.size());
  EXPECT_GE(free.minCoeff(), -1e-7);
  EXPECT_GE(rest.pressing_n.minCoeff(), 0.0);
  EXPECT_LT((rest.pressing_n.array() * free.array()).abs().maxCoeff(), 1e-7);
  const auto open = value_or_fail(body.solve(load, VecX::Constant(gaps.size(), kNoWall)));
  EXPECT_GT((body.outward(open.displacement) - gaps).maxCoeff(), 0.5);
}

TEST_F(OnTheToy, TheAnswerDoesNotDependOnWhereTheSearchBegins) {
  const auto first = value_or_fail(body.solve(load, body.gaps()));
  value_or_fail(body.solve(-load, body.gaps()));
  const auto again = value_or_fail(body.solve(load, body.gaps()));
  EXPECT_LT((again.displacement - first.displacement).cwiseAbs().maxCoeff(), 1e-8);
}

TEST_F(OnTheToy, SheetsHold) {
  Changes changes;
  changes.sheets = true;
  auto held = value_or_fail(
      ContactBody::make(head.space(), tissue_of(head, changes, 3), supports_of(head, changes, 3)));
  const Points with = value_or_fail(held.solve(load, held.gaps())).displacement;
  const Points without = value_or_fail(body.solve(load, body.gaps())).displacement;
  double falx = 0.0, tentorium = 0.0, moved = 0.0;
  int nodes = 0;
  for (int i = 0; i < head.space().num_nodes(); ++i) {
    const Vec3 x = head.space().nodes.col(i);
    if (on_falx(head, x, 1.0)) {
      ++nodes;
      falx = std::max(falx, std::abs(with(0, i)));
      moved = std::max(moved, std::abs(without(0, i)));
    } else if (on_tentorium(head, x, 1.0)) {
      tentorium = std::max(tentorium, std::abs(tentorium_normal().dot(with.col(i))));
    }
  }
  EXPECT_GT(nodes, 20);
  EXPECT_LT(falx, 1e-12);
  EXPECT_LT(tentorium, 1e-12);
  EXPECT_GT(moved, 0.5);
}

TEST(Loads, WeightIsThatOfTheTissue) {
  const Points load =
      weight_load(toy_head().space(), -Vec3::UnitZ(), [](const Vec3&) { return true; });
  const Vec3 sum = load.rowwise().sum();
  EXPECT_NEAR(sum[2], -60.0 * 60.0 * 60.0 * 9.80665e-6, 1e-9);
  EXPECT_NEAR(sum.head<2>().norm(), 0.0, 1e-12);
}

// Pressure inside the body balances itself, and does the work p dV.
TEST(Loads, PressureBalances) {
  const fem::DisplacementSpace& space = toy_head().space();
  const Points load = pressure_load(space, [](const Vec3& x) { return x[0] < 25.0 ? 2.0 : 0.5; });
  const Vec3 sum = load.rowwise().sum();
  Vec3 moment = Vec3::Zero();
  for (int i = 0; i < space.num_nodes(); ++i) {
    moment += Vec3(space.nodes.col(i)).cross(Vec3(load.col(i)));
  }
  EXPECT_LT(sum.norm(), 1e-8);
  EXPECT_LT(moment.norm(), 1e-6);
  const Points even = pressure_load(space, [](const Vec3&) { return 2.0; });
  const Points grown = 0.01 * space.nodes;
  EXPECT_NEAR(even.cwiseProduct(grown).sum(), 2.0 * 0.03 * 60.0 * 60.0 * 60.0, 1e-6);
  EXPECT_NEAR(volume_loss(space, -grown, [](const Vec3& x) { return x[2] > 20.0; }), 0.03, 1e-12);
}

TEST(Kinds, HaveNamesOfTheirOwnAndAreFound) {
  for (const Kind& kind : all_kinds()) EXPECT_EQ(find_kind(kind.name), &kind);
  EXPECT_EQ(all_kinds().size(), 15u);
  EXPECT_EQ(find_kind("sag"), nullptr);
}

// Of elements beyond the middle no node has weight.
TEST(Kinds, AirOnOneSideWeighsOnThatSideOnly) {
  const OutsideHead& head = toy_head();
  Random random(5);
  for (const char* name : {"air-side", "air-side-partial"}) {
    const Points load = find_kind(name)->draw(head, random).load(head.space());
    double opened = 0.0, other = 0.0;
    for (int i = 0; i < head.space().num_nodes(); ++i) {
      const double weight = load.col(i).norm();
      const double side = head.side_of(head.space().nodes.col(i));
      (side > 0.0 ? opened : other) += side < -1e-9 || side > 0.0 ? weight : 0.0;
    }
    EXPECT_GT(opened, 0.05) << name;
    EXPECT_EQ(other, 0.0) << name;
  }
}

class EveryKind : public testing::TestWithParam<const Kind*> {
 protected:
  static OutsideTruths& truths() {
    static const auto made = value_or_fail(OutsideTruths::make(toy(), test_support::toy_config()));
    return *made;
  }
};

TEST_P(EveryKind, MovesTheHeadByWhatIsPlausibleAndTurnsNothingInsideOut) {
  const OutsideTruth truth = value_or_fail(truths().make(*GetParam(), 7));
  ASSERT_EQ(truth.displacement.cols(), toy().mesh.num_nodes());
  EXPECT_TRUE(truth.displacement.allFinite());
  EXPECT_GT(truth.largest_mm, 0.5);
  EXPECT_LT(truth.largest_mm, 16.0);
  EXPECT_GE(truth.min_volume_ratio, OutsideTruths::kLeastVolume);
  EXPECT_EQ(truth.resected_fraction.has_value(), GetParam()->name == "cavity");
  if (GetParam()->name == "ventricles-drain") {
    EXPECT_GT(truth.volume_loss, 0.1);
    EXPECT_LT(truth.volume_loss, 0.73);
  }
}

INSTANTIATE_TEST_SUITE_P(Outside, EveryKind, testing::ValuesIn([] {
                           std::vector<const Kind*> kinds;
                           for (const Kind& kind : all_kinds()) kinds.push_back(&kind);
                           return kinds;
                         }()),
                         [](const auto& tested) {
                           std::string name = tested.param->name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(OutsideTruths, TheSeedDecides) {
  const auto truths = value_or_fail(OutsideTruths::make(toy(), test_support::toy_config()));
  const Kind& kind = *find_kind("air-side");
  const Points one = value_or_fail(truths->make(kind, 1)).displacement;
  const Points other = value_or_fail(truths->make(kind, 2)).displacement;
  value_or_fail(truths->make(*find_kind("bulge"), 1));
  const Points again = value_or_fail(truths->make(kind, 1)).displacement;
  EXPECT_LT((again - one).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_GT((other - one).cwiseAbs().maxCoeff(), 0.1);
}

// Small loads: the geometry hardly follows, and the steps add up to the linear answer.
TEST(OutsideTruths, StepsOfASmallLoadAreTheLinearAnswer) {
  const auto truths = value_or_fail(OutsideTruths::make(toy(), test_support::toy_config()));
  static Event event;
  event.load = [](const fem::DisplacementSpace& space) {
    return weight_load(space, -Vec3::UnitZ(), [](const Vec3&) { return true; });
  };
  event.largest_mm = 0.05;
  const auto make = [&](int steps) {
    event.steps = steps;
    const Kind kind{"small", "", [](const OutsideHead&, Random&) { return event; }};
    return value_or_fail(truths->make(kind, 4)).displacement;
  };
  const Points linear = make(1), stepped = make(5);
  EXPECT_LT((stepped - linear).cwiseAbs().maxCoeff(), 0.002);
  EXPECT_GT(linear.cwiseAbs().maxCoeff(), 0.04);
}

// A strain whose geometry cannot be solved is refused with the step where it ends.
TEST(OutsideTruths, AStrainThatCannotBeSolvedIsRefused) {
  const auto truths = value_or_fail(OutsideTruths::make(toy(), test_support::toy_config()));
  const Kind kind{"too-far", "", [](const OutsideHead&, Random&) {
                    Event event;
                    event.load = [](const fem::DisplacementSpace& space) {
                      return weight_load(space, -Vec3::UnitZ(),
                                         [](const Vec3& x) { return x[2] > 40.0; });
                    };
                    event.largest_mm = 100.0;
                    event.steps = 4;
                    return event;
                  }};
  const auto truth = truths->make(kind, 4);
  ASSERT_FALSE(truth);
  EXPECT_EQ(truth.error().code, ErrorCode::kNotConverged);
  EXPECT_NE(truth.error().message.find("kind too-far, seed 4: step "), std::string::npos)
      << truth.error().message;
}

}  // namespace
}  // namespace brainshift::outside
