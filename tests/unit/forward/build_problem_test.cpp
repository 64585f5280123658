// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "common/contact/surface_contact.hpp"
#include "common/forward/build_problem.hpp"
#include "common/forward/forward_problem.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::forward {
namespace {

using testing::HasSubstr;

// Two layers, labels 1 (named "low") and 2; triangles: one of the bottom turned inwards, one
// inside the body.
GroupedMesh layers() {
  GroupedMesh file;
  file.mesh = test_support::box_mesh(1, 1, 2, Vec3(1.0, 1.0, 2.0));
  for (int t = 0; t < file.mesh.num_tets(); ++t) {
    double z = 0.0;
    for (int k = 0; k < 4; ++k) z += 0.25 * file.mesh.nodes(2, file.mesh.tets(k, t));
    file.mesh.labels.push_back(z < 1.0 ? 1 : 2);
  }
  file.volume_names = {{"low", 1}};
  file.surface_names = {{"bottom", 7}};
  file.triangles.resize(3, 2);
  file.triangles << 0, 4, 1, 5, 3, 7;  // counter-clockwise seen from above
  file.triangle_labels = {7, 9};
  return file;
}

ProblemSpec spec() {
  ProblemSpec spec;
  MaterialSpec tissue;
  tissue.name = "tissue";
  tissue.youngs_modulus_pa = 3000.0;
  tissue.poisson_ratio = 0.25;
  tissue.density_kg_m3 = 1000.0;
  tissue.permeability_m3_s_kg = 1e-7;
  tissue.storage_per_pa = 1e-6;
  spec.materials = {tissue};
  spec.regions = {{"all", "tissue"}};
  return spec;
}

TEST(BuildProblem, ConvertsUnits) {
  ProblemSpec file = spec();
  file.gravity_m_s2 = Vec3(0, 0, -10.0);
  file.body_force_n_m3 = Vec3(5e9, 0, 0);
  const auto problem = value_or_fail(build_problem(file, layers(), {}));
  const fem::PoroMaterial& material = problem.materials.at(0);
  EXPECT_NEAR(material.elastic.shear, 0.0012, 1e-15);
  EXPECT_NEAR(material.elastic.lambda, 0.0012, 1e-15);  // nu = 1/4: lambda = G
  EXPECT_NEAR(material.permeability, 1e5, 1e-7);        // m^3 s/kg = 1e12 mm^4/(N s)
  EXPECT_NEAR(material.storage, 1.0, 1e-12);
  EXPECT_NEAR(problem.body_force(2, 0), -1e-5, 1e-18);
  EXPECT_NEAR(problem.body_force(0, 0), 5.0, 1e-12);
}

TEST(BuildProblem, NamedRegionsGoBeforeAll) {
  ProblemSpec file = spec();
  file.materials.push_back(file.materials[0]);
  file.materials[1].name = "stiff";
  file.regions = {{"all", "tissue"}, {"low", "stiff"}};
  const auto problem = value_or_fail(build_problem(file, layers(), {}));
  const auto labels = layers().mesh.labels;
  for (std::size_t t = 0; t < labels.size(); ++t)
    EXPECT_EQ(problem.materials.of_tet[t], labels[t] == 1 ? 1 : 0);
}

TEST(BuildProblem, FacesLookOutwardsAndInnerOnesAreKnown) {
  const auto problem = value_or_fail(build_problem(spec(), layers(), {}));
  const FaceGroup& bottom = problem.groups.at("bottom");
  ASSERT_EQ(bottom.faces.cols(), 1);
  const Points& x = problem.mesh.nodes;
  const Vec3 a = x.col(bottom.faces(0, 0));
  const Vec3 normal = (x.col(bottom.faces(1, 0)) - a).cross(Vec3(x.col(bottom.faces(2, 0)) - a));
  EXPECT_LT(normal[2], 0.0);
  EXPECT_EQ(problem.groups.at("9").faces.cols(), 0);
  EXPECT_EQ(problem.groups.at("9").inner.cols(), 1);
}

TEST(BuildProblem, RejectsWhatTheMeshDoesNotHave) {
  const auto message = [](const ProblemSpec& file) {
    const auto problem = build_problem(file, layers(), {});
    return problem ? std::string("accepted") : problem.error().message;
  };
  ProblemSpec file = spec();
  file.regions = {{"low", "tissue"}};
  EXPECT_THAT(message(file), HasSubstr("regions: region 2 of the mesh has no material"));
  file.regions = {{"3", "tissue"}};
  EXPECT_THAT(message(file),
              HasSubstr("regions.3: the mesh has no such region (there: 2, all, low)"));
  file = spec();
  file.groups.push_back({"away", PlaneSelector{Vec3(0, 0, 9), Vec3::UnitZ(), 0.1}});
  EXPECT_THAT(message(file), HasSubstr("groups.away"));
  file = spec();
  file.time = TimeSpec{{1.0}};
  EXPECT_EQ(message(file), "accepted");
}

// A block on a ball, held at its top: the stress, the pressed points and nothing else balance at
// every free node.
TEST(Solve, ContactSolutionIsInEquilibriumWithWhatPresses) {
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    ForwardProblem problem;
    problem.mesh = test_support::box_mesh(4, 4, 3, Vec3(4.0, 4.0, 3.0));
    problem.element = element;
    problem.materials =
        fem::MaterialMap::uniform({fem::Elasticity{0.003, 0.002}}, problem.mesh.num_tets());
    const auto boundary = geometry::boundary_triangles(problem.mesh);
    std::vector<int> low, high;
    for (int f = 0; f < boundary.cols(); ++f) {
      const auto z = problem.mesh.nodes(2, boundary.col(f).array());
      if (z.maxCoeff() == 0.0) low.push_back(f);
      if (z.minCoeff() == 3.0) high.push_back(f);
    }
    for (const auto& [name, faces] : {std::pair{"low", low}, std::pair{"high", high}}) {
      FaceGroup group{{}, boundary(Eigen::all, faces), {}};
      group.vertices.assign(group.faces.data(), group.faces.data() + group.faces.size());
      problem.groups[name] = group;
    }
    problem.conditions = {{"push", "high", Displacement{{0.0, 0.0, -0.3}}}};
    problem.contacts = {{"ball", "low", contact::RigidSphere{Vec3(1.7, 2.1, -9.9), 10.0}, {}}};
    const auto solution = value_or_fail(solve(problem));
    EXPECT_GT(solution.iterations, 2);
    ASSERT_GT(solution.contacts[0].active, 3);
    ASSERT_LT(solution.contacts[0].active, solution.contacts[0].points);

    contact::SurfaceContact contact(solution.space);
    ASSERT_TRUE(contact.add(problem.groups["low"].faces, problem.contacts[0].obstacle,
                            default_penalty(problem, problem.groups["low"])));
    const VecX pressed = contact.penetration(solution.displacement).cwiseMax(0.0);
    Points force = -fem::internal_force(solution.space, problem.materials, solution.displacement);
    const double scale = force.norm();
    ASSERT_GT(scale, 0.0);
    contact.add_force(pressed, contact::ActiveSet(static_cast<std::size_t>(pressed.size()), 1),
                      force);
    for (int n = 0; n < solution.space.num_nodes(); ++n) {
      if (solution.space.nodes(2, n) == 3.0) force.col(n).setZero();
    }
    EXPECT_LT(force.norm(), 1e-10 * scale);
    EXPECT_LT((solution.contacts[0].force + solution.reaction).norm(), 1e-10 * scale);
  }
}

TEST(Solve, RejectsLoadsOnInnerFaces) {
  auto problem = value_or_fail(build_problem(spec(), layers(), {}));
  problem.groups["9"].faces = problem.groups["bottom"].faces;
  problem.conditions = {{"press", "9", Pressure{1.0}}};
  EXPECT_THAT(sentence_of(solve(problem)), HasSubstr("conditions.press.on = 9"));
}

TEST(Support, ThreeTwoOneHoldsABodyOfAnySize) {
  for (const double size : {1e-3, 1.0, 1e4}) {
    const Vec3 centre(5.0, 5.0, 5.0);
    const Vec3 a = centre, b = centre + size * Vec3::UnitX(), c = centre + size * Vec3::UnitY();
    std::vector<HeldDirection> held = {{a, Vec3::UnitX()}, {a, Vec3::UnitY()}, {a, Vec3::UnitZ()},
                                       {b, Vec3::UnitY()}, {b, Vec3::UnitZ()}, {c, Vec3::UnitZ()}};
    EXPECT_TRUE(check_support(held, centre, size));
    held.pop_back();
    EXPECT_THAT(refusal_of(check_support(held, centre, size), ErrorCode::kFloatingBody),
                testing::HasSubstr("1 of its 6 rigid motions is free"));
  }
}

TEST(Support, NothingHeldLeavesSixMotions) {
  EXPECT_THAT(sentence_of(check_support({}, Vec3::Zero(), 1.0)), testing::HasSubstr("6 of its 6"));
}

}  // namespace
}  // namespace brainshift::forward
