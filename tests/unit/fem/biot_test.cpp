// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/biot.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::fem {
namespace {

using testing::HasSubstr;

PoroMaterial tissue() {
  PoroMaterial material;
  material.elastic = {0.02, 0.0021};
  material.permeability = 1e5;
  material.storage = 2.0;
  material.biot_coefficient = 0.9;
  return material;
}

struct Cube {
  TetMesh mesh = test_support::box_mesh(3, 3, 3, Vec3::Constant(30.0));
  DofMap dofs{mesh.num_nodes()};
  std::vector<NodeIndex> drained;
  MaterialMap materials = MaterialMap::uniform(tissue(), mesh.num_tets());
  Cube() {
    test_support::perturb_interior(mesh, 1.0, 5);
    for (int n = 0; n < mesh.num_nodes(); ++n) {
      // One face held, one node of the opposite face free to slide along an oblique plane.
      if (mesh.nodes(0, n) == 0.0) dofs.fix_all(n);
      if (mesh.nodes(2, n) == 30.0) drained.push_back(n);
    }
    dofs.fix_normal(mesh.num_nodes() - 1, Vec3(1, 2, 2).normalized());
    dofs.finalise();
  }
  Result<BiotStepper> stepper(const BiotOptions& options = {}) const {
    return BiotStepper::build(mesh, materials, dofs, drained, options);
  }
  BiotLoad load() const {
    BiotLoad load;
    load.force = Points::Constant(3, mesh.num_nodes(), 1e-4);
    load.source = VecX::LinSpaced(mesh.num_nodes(), -1.0, 2.0);
    load.pressure = VecX::Constant(mesh.num_nodes(), 3e-4);
    load.displacement = Points::Constant(3, mesh.num_nodes(), 0.1);
    return load;
  }
};

TEST(BiotStepper, MatrixIsThatOfTheElementsAndTheStepLeavesNoResidual) {
  const Cube cube;
  auto stepper = value_or_fail(cube.stepper());
  const BiotLoad load = cube.load();
  const auto first =
      value_or_fail(stepper.step(BiotState::at_rest(cube.mesh.num_nodes()), load, 0.3));
  const auto second = value_or_fail(stepper.step(first, load, 0.7));

  // Equilibrium at free nodes; what is prescribed is met.
  const Points unbalanced = stepper.internal_force(second) - load.force;
  EXPECT_LT(cube.dofs.restrict_to(unbalanced).cwiseAbs().maxCoeff(), 1e-12);
  const NodeIndex slider = cube.mesh.num_nodes() - 1;
  const Vec3 normal = cube.dofs.frame(slider).col(0);
  EXPECT_NEAR(normal.dot(second.displacement.col(slider)), normal.dot(Vec3::Constant(0.1)), 1e-12);
  EXPECT_GT((second.displacement.col(slider) - Vec3::Constant(0.1)).norm(), 1e-3);
  for (int n = 0; n < cube.mesh.num_nodes(); ++n) {
    if (cube.mesh.nodes(0, n) == 0.0) {
      EXPECT_LT((second.displacement.col(n) - Vec3::Constant(0.1)).norm(), 1e-12);
    }
  }
  for (const NodeIndex n : cube.drained) EXPECT_DOUBLE_EQ(second.pressure[n], 3e-4);

  // Mass balance of the whole: what flowed in is stored or leaves through drained nodes. Summed
  // over all test functions the diffusion vanishes, so only the rows of drained nodes hold a
  // flow.
  BiotLoad sealed = load;
  sealed.displacement = Points();
  sealed.pressure = VecX();
  auto closed = value_or_fail(BiotStepper::build(cube.mesh, cube.materials, cube.dofs, {}));
  const auto filled =
      value_or_fail(closed.step(BiotState::at_rest(cube.mesh.num_nodes()), sealed, 0.3));
  double stored = 0.0;
  for (int t = 0; t < cube.mesh.num_tets(); ++t) {
    const TetGeometry geometry = tet_geometry(cube.mesh, t);
    double divergence = 0.0, mean = 0.0;
    for (int i = 0; i < 4; ++i) {
      divergence += geometry.gradients.col(i).dot(filled.displacement.col(cube.mesh.tets(i, t)));
      mean += 0.25 * filled.pressure[cube.mesh.tets(i, t)];
    }
    stored += geometry.volume * (0.9 * divergence + 2.0 * mean);
  }
  EXPECT_NEAR(stored, 0.3 * load.source.sum(), 1e-10 * std::abs(stored));
}

TEST(BiotStepper, ReturnsToRestWithoutLoad) {
  const Cube cube;
  auto stepper = value_or_fail(cube.stepper());
  BiotLoad load;
  load.force = Points::Constant(3, cube.mesh.num_nodes(), 1e-4);
  auto state = stepper.step(BiotState::at_rest(cube.mesh.num_nodes()), load, 0.3);
  ASSERT_TRUE(state.has_value());
  EXPECT_GT(state->displacement.norm(), 1e-3);
  state = stepper.step(*state, {}, 1e12);
  ASSERT_TRUE(state.has_value());
  EXPECT_LT(state->displacement.norm(), 1e-9);
}

TEST(BiotStepper, KeepsTheFactorsOfTheStepSizesUsedLast) {
  const Cube cube;
  auto stepper = value_or_fail(cube.stepper({.kept_factors = 2}));
  const auto factorised = [&](double dt) {
    EXPECT_TRUE(
        stepper.step(BiotState::at_rest(cube.mesh.num_nodes()), cube.load(), dt).has_value());
    return stepper.diagnostics().factorised;
  };
  EXPECT_TRUE(factorised(1.0));
  EXPECT_TRUE(factorised(2.0));
  EXPECT_FALSE(factorised(1.0));
  EXPECT_TRUE(factorised(3.0));  // drops 2, the one used longest ago
  EXPECT_FALSE(factorised(1.0));
  EXPECT_TRUE(factorised(2.0));
}

TEST(BiotStepper, ReportsWhereItStabilises) {
  Cube cube;
  // Half of the tetrahedra a thousandth as permeable.
  PoroMaterial tight = tissue();
  tight.permeability /= 1e3;
  cube.materials.materials.push_back(tight);
  for (int t = 0; t < cube.mesh.num_tets(); t += 2) cube.materials.of_tet[t] = 1;
  auto stepper = value_or_fail(cube.stepper());
  const auto stabilised = [&](double dt) {
    EXPECT_TRUE(
        stepper.step(BiotState::at_rest(cube.mesh.num_nodes()), cube.load(), dt).has_value());
    return stepper.diagnostics().stabilised_tets;
  };
  const double shortest = stepper.diagnostics().smallest_bound_s;
  const double longest = stepper.diagnostics().largest_bound_s;
  EXPECT_GT(longest, 500.0 * shortest);
  EXPECT_EQ(stabilised(0.5 * shortest), cube.mesh.num_tets());
  EXPECT_EQ(stabilised(30.0 * shortest), (cube.mesh.num_tets() + 1) / 2);
  EXPECT_EQ(stabilised(2.0 * longest), 0);
}

TEST(BiotStepper, NamesWhatIsWrongWithTheDomain) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const auto& spoil) {
    Cube cube;
    spoil(cube);
    const auto built = cube.stepper();
    return built ? std::string("accepted") : built.error().message;
  };
  const auto of_material = [&](const auto& spoil) {
    return message([&](Cube& cube) { spoil(cube.materials.materials[0]); });
  };
  EXPECT_THAT(of_material([](auto& m) { m.elastic.shear = -1.0; }),
              HasSubstr("shear modulus = -1"));
  EXPECT_THAT(of_material([](auto& m) { m.elastic.lambda = -1.0; }), HasSubstr("bulk modulus"));
  EXPECT_THAT(of_material([](auto& m) { m.biot_coefficient = 1.5; }),
              HasSubstr("Biot coefficient = 1.5"));
  EXPECT_THAT(of_material([](auto& m) { m.storage = -1.0; }), HasSubstr("storage = -1"));
  EXPECT_THAT(of_material([&](auto& m) { m.permeability = nan; }), HasSubstr("permeability = nan"));
  EXPECT_THAT(message([](Cube& c) { c.materials.of_tet[0] = 4; }), HasSubstr("material index = 4"));
  EXPECT_THAT(message([](Cube& c) { c.materials.of_tet.pop_back(); }), HasSubstr("materials for"));
  EXPECT_THAT(message([](Cube& c) { c.drained.push_back(900); }), HasSubstr("drained node = 900"));
}

TEST(BiotStepper, NamesWhatIsWrongWithAStep) {
  const Cube cube;
  auto stepper = value_or_fail(cube.stepper());
  const BiotState rest = BiotState::at_rest(cube.mesh.num_nodes());
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double dt : {0.0, -1.0, infinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(sentence_of(stepper.step(rest, {}, dt)), HasSubstr("time step"));
  }
  BiotLoad load;
  load.source = VecX::Ones(3);
  EXPECT_THAT(stepper.step(rest, load, 1.0).error().message, HasSubstr("source = 3"));
  load = cube.load();
  load.force(1, 4) = infinity;
  EXPECT_EQ(stepper.step(rest, load, 1.0).error().code, ErrorCode::kNotFinite);
  EXPECT_FALSE(stepper.step({}, {}, 1.0).has_value());
}

}  // namespace
}  // namespace brainshift::fem
