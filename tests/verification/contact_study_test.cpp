// SPDX-License-Identifier: GPL-3.0-or-later
// Contact against closed forms.
//
// Hertz (Johnson, Contact Mechanics, 1985, eq. 4.22-4.24): an elastic half-space on a rigid ball of radius R, approach
// delta, E* = E / (1 - nu^2):
//   contact radius a = sqrt(R delta),   force F = 4/3 E* sqrt(R) delta^(3/2),   pressure at the centre 2 E* a / (pi R)
// An eighth of a ball of 10 a stands for the half-space; its outer surface moves as under a point load F
// (Boussinesq; Johnson, section 3.2), which is where the far field of any contact pressure tends to.
//
// Signorini: a block that is pushed down by d over a gap g onto a floor without friction: strain (d - g) / H.
#include <cmath>
#include <numbers>

#include "tests/support/ball_mesh.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/study_record.hpp"
#include "tests/verification/forward_fixture.hpp"

namespace brainshift::verification {
namespace {

constexpr double kYoungs = 0.003, kNu = 0.3;
constexpr double kBall = 100.0, kContactRadius = 4.0;
constexpr double kApproach = kContactRadius * kContactRadius / kBall;
constexpr double kEffective = kYoungs / (1.0 - kNu * kNu);
constexpr double kForce = 4.0 / 3.0 * kEffective * kContactRadius * kApproach;
constexpr double kPeak = 2.0 * kEffective * kContactRadius / (std::numbers::pi * kBall);

// Displacement of the half-space z > 0 under a point load F along +z at the origin.
Vec3 boussinesq(const Vec3& x) {
  const double shear = kYoungs / (2.0 * (1.0 + kNu));
  const double rho = x.norm(), r = std::hypot(x[0], x[1]), z = x[2];
  const double scale = kForce / (4.0 * std::numbers::pi * shear);
  const double radial = r * z / (rho * rho * rho) - (1.0 - 2.0 * kNu) * r / (rho * (rho + z));
  const Vec3 out = r > 0.0 ? Vec3(x[0] / r, x[1] / r, 0.0) : Vec3(Vec3::Zero());
  return scale *
         (radial * out + (z * z / (rho * rho * rho) + 2.0 * (1.0 - kNu) / rho) * Vec3::UnitZ());
}

struct HertzErrors {
  double force_pct = 0.0, radius_pct = 0.0, peak_pct = 0.0;
  int unknowns = 0, iterations = 0;
};

HertzErrors hertz(fem::Element element, int per_radius) {
  const double h = kContactRadius / per_radius, outer = 10.0 * kContactRadius;
  std::vector<double> radii = {0.0};
  while (radii.back() < 1.5 * kContactRadius - 0.5 * h) radii.push_back(radii.back() + h);
  const double growth = 1.0 + 1.5 / per_radius;
  double step = h;
  while (radii.back() + step < outer) radii.push_back(radii.back() + (step *= growth));
  radii.back() = outer;
  auto problem = problem_on(test_support::octant_mesh(radii, 2 * per_radius), element,
                            elasticity(kYoungs, kNu));
  add_symmetry(problem, false);
  add_condition(
      problem, "far", [&](const Vec3& x) { return x.norm() > 0.9999 * outer; },
      forward::DisplacementField{boussinesq});
  problem.groups["floor"] = faces_where(
      problem.mesh, [](const Vec3& x) { return x[2] == 0.0 && x.norm() < 2.5 * kContactRadius; });
  problem.contacts.push_back(
      {"ball", "floor", contact::RigidSphere{Vec3(0, 0, kApproach - kBall), kBall}, std::nullopt});
  const auto solution = solved(problem);
  const forward::ContactResult& contact = solution.contacts.front();
  HertzErrors errors;
  errors.unknowns = solution.unknowns;
  errors.iterations = solution.iterations;
  errors.force_pct = 100.0 * std::abs(4.0 * contact.force[2] / kForce - 1.0);
  errors.peak_pct = 100.0 * std::abs(solution.contact_pressure[0] / kPeak - 1.0);
  errors.radius_pct =
      100.0 * std::abs(std::sqrt(4.0 * contact.area_mm2 / std::numbers::pi) / kContactRadius - 1.0);
  return errors;
}

constexpr char kHertzSource[] = "Johnson 1985 eq. 4.22 to 4.24";

void record_hertz(fem::Element element, int per_radius, const HertzErrors& e) {
  const auto point = [&](const char* what, double error) {
    test_support::record({"hertz", std::string(name_of(element)) + " " + what,
                          "elements per contact radius", "error %", static_cast<double>(per_radius),
                          error});
  };
  point("force", e.force_pct);
  point("contact radius", e.radius_pct);
  point("central pressure", e.peak_pct);
}

TEST(Hertz, ForceRadiusAndPressureConverge) {
  std::vector<HertzErrors> p2;
  for (const int n : {2, 3, 4}) {
    p2.push_back(hertz(fem::Element::kP2, n));
    record_hertz(fem::Element::kP2, n, p2.back());
    if (p2.size() < 2) continue;
    const HertzErrors& before = p2[p2.size() - 2];
    EXPECT_LT(p2.back().force_pct, before.force_pct);
    EXPECT_LT(p2.back().radius_pct, before.radius_pct);
    EXPECT_LT(p2.back().peak_pct, before.peak_pct);
  }
  const auto within = [](const char* name, double error) {
    return test_support::record_check("hertz", name, error, "<= 3", error <= 3.0, kHertzSource);
  };
  EXPECT_TRUE(within("P2 force error %", p2.back().force_pct));
  EXPECT_TRUE(within("P2 contact radius error %", p2.back().radius_pct));
  EXPECT_TRUE(within("P2 central pressure error %", p2.back().peak_pct));
}

// P1 needs twice the elements for the force; its pressure, from constant stress, comes later still.
TEST(Hertz, ForceOfLinearElementsConverges) {
  double before = 100.0;
  for (const int n : {2, 4, 6}) {
    const HertzErrors e = hertz(fem::Element::kP1, n);
    record_hertz(fem::Element::kP1, n, e);
    EXPECT_LT(e.force_pct, before);
    before = e.force_pct;
  }
  EXPECT_TRUE(test_support::record_check("hertz", "P1 force error %", before, "<= 5", before <= 5.0,
                                         kHertzSource));
}

constexpr double kHeight = 10.0, kGap = 0.5, kPush = 1.0;

forward::ForwardProblem signorini_block(fem::Element element, int cells, double gap) {
  auto problem = problem_on(test_support::box_mesh(cells, cells, cells, Vec3::Constant(kHeight)),
                            element, elasticity(kYoungs, kNu));
  add_symmetry(problem, false);
  problem.groups["bottom"] = faces_where(problem.mesh, [](const Vec3& x) { return x[2] == 0.0; });
  problem.contacts.push_back(
      {"floor", "bottom", contact::RigidPlane{Vec3(0, 0, -gap), Vec3::UnitZ()}, std::nullopt});
  return problem;
}

// Largest error over the vertices, % of the compression.
double block_error(const forward::ForwardProblem& problem, const Points& u, double gap,
                   double strain) {
  double error = 0.0;
  for (int n = 0; n < problem.mesh.num_nodes(); ++n) {
    const Vec3 x = problem.mesh.nodes.col(n);
    const Vec3 exact(kNu * strain * x[0], kNu * strain * x[1], -gap - strain * x[2]);
    error = std::max(error, (u.col(n) - exact).norm());
  }
  return 100.0 * error / (strain * kHeight);
}

TEST(Signorini, BlockOverAGapIsCompressedUniformly) {
  const double strain = (kPush - kGap) / kHeight;
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    double before = 100.0;
    for (const int cells : {2, 4, 8}) {
      auto problem = signorini_block(element, cells, kGap);
      add_condition(
          problem, "top", [](const Vec3& x) { return x[2] == kHeight; },
          forward::Displacement{{std::nullopt, std::nullopt, -kPush}});
      const auto solution = solved(problem);
      const double error = block_error(problem, solution.displacement, kGap, strain);
      test_support::record(
          {"signorini", name_of(element), "element size mm", "error %", kHeight / cells, error});
      EXPECT_LT(error, before);
      before = error;
      EXPECT_NEAR(solution.contacts[0].force[2], kYoungs * strain * kHeight * kHeight,
                  0.03 * kYoungs * strain * kHeight * kHeight);
    }
    EXPECT_TRUE(test_support::record_check(
        "signorini", std::string(name_of(element)) + " displacement error %", before, "<= 3",
        before <= 3.0, "uniform uniaxial compression"));
  }
}

// Nothing but the floor holds the block up.
TEST(Signorini, BlockThatRestsOnTheFloorCarriesItsLoad) {
  const double pressure = 0.01 * kYoungs;
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    auto problem = signorini_block(element, 4, 0.0);
    add_condition(
        problem, "top", [](const Vec3& x) { return x[2] == kHeight; }, forward::Pressure{pressure});
    const auto solution = solved(problem);
    EXPECT_LT(block_error(problem, solution.displacement, 0.0, 0.01), 3.0);
    EXPECT_NEAR(solution.contacts[0].force[2], pressure * kHeight * kHeight,
                1e-9 * pressure * kHeight * kHeight);
    EXPECT_LT(solution.reaction.norm(), 1e-9 * pressure * kHeight * kHeight);
  }
}

}  // namespace
}  // namespace brainshift::verification
