// SPDX-License-Identifier: GPL-3.0-or-later
// Contact against closed forms.
//
// Hertz (Johnson, Contact Mechanics, 1985, eq. 4.22-4.24): an elastic half-space on a rigid ball
// of radius R, approach delta, E* = E / (1 - nu^2):
//   contact radius a = sqrt(R delta),   force F = 4/3 E* sqrt(R) delta^(3/2)
//   pressure at the centre 2 E* a / (pi R)
// An eighth of a ball of 10 a stands for the half-space. Its outer surface moves as under a point
// load F (Boussinesq; Johnson, section 3.2), to which the far field of any contact pressure
// tends.
//
// Signorini: a block on a rigid floor without friction.
//   manufactured  a solution whose contact ends at a line x = x0 inside the floor; the solver does
//                 not know where
//   over a gap    pushed down by d over a gap g: uniform compression; penalty and block are two
//                 springs in series
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

// P1 needs twice the elements for the force. Its pressure, from constant stress, converges later.
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

// Manufactured solution of a Signorini problem on x, z in [0, kHeight], floor at z = -kGap below
// the face z = 0. With X = max(x - x0, 0) and W = max(x0 - x, 0):
//
//   u_x = -3 c z X^2,   u_y = 0,   u_z = -g + c X^3 - q z W^2
//
// On z = 0 the face touches the floor for x <= x0 and is c X^3 > 0 above it beyond; the normal
// stress there is -(lambda + 2 G) q W^2, so the pressure is positive for x < x0 and zero beyond;
// the shear stress is zero. These are all conditions of frictionless contact, and its solution is
// unique, so this is the solution for the body force b = -div sigma(u) below and u prescribed on
// the sides.
struct Manufactured {
  // x0 lies on no node of any of the meshes. q and c: strains of a few percent.
  static constexpr double kEnd = 5.3, kQ = 1.7e-3, kC = 8e-4;
  fem::Elasticity material = elasticity(kYoungs, kNu);

  static double beyond(const Vec3& x) { return std::max(x[0] - kEnd, 0.0); }
  static double before(const Vec3& x) { return std::max(kEnd - x[0], 0.0); }
  static Vec3 displacement(const Vec3& x) {
    const double X = beyond(x), W = before(x);
    return {-3.0 * kC * x[2] * X * X, 0.0, -kGap + kC * X * X * X - kQ * x[2] * W * W};
  }
  double pressure(const Vec3& x) const {
    return (material.lambda + 2.0 * material.shear) * kQ * before(x) * before(x);
  }
  // sigma_xx = -6 (lambda + 2 G) c z X - lambda q W^2,   sigma_xz = 2 G q z W,
  // sigma_zz = -6 lambda c z X - (lambda + 2 G) q W^2;   the others do not enter the divergence.
  Vec3 body_force(const Vec3& x) const {
    const double along = material.lambda + 2.0 * material.shear;
    const double X = beyond(x), W = before(x);
    const double open = X > 0.0 ? 1.0 : 0.0;
    return {6.0 * along * kC * x[2] * open - 2.0 * (material.lambda + material.shear) * kQ * W, 0.0,
            2.0 * material.shear * kQ * x[2] * (1.0 - open) + 6.0 * material.lambda * kC * X};
  }
};

struct SignoriniErrors {
  double displacement_pct = 0.0;  // L2 over the body, of the displacement beyond the gap
  double pressure_pct = 0.0;      // largest error on the floor, of the largest pressure
  double end_mm = 0.0;            // where the contact ends, from its area
};

// Solves for one mesh; errors are integrated with the fine quadrature rule.
SignoriniErrors manufactured(fem::Element element, int cells) {
  const Manufactured exact;
  // Nothing depends on y: one cell across.
  const double width = kHeight / cells;
  auto problem = problem_on(test_support::box_mesh(cells, 1, cells, Vec3(kHeight, width, kHeight)),
                            element, exact.material);
  problem.body_field = [exact](const Vec3& x) { return exact.body_force(x); };
  add_condition(
      problem, "sides", [](const Vec3& x) { return x[0] == 0.0 || x[0] == kHeight; },
      forward::DisplacementField{Manufactured::displacement});
  add_condition(
      problem, "top", [](const Vec3& x) { return x[2] == kHeight; },
      forward::DisplacementField{Manufactured::displacement});
  add_condition(
      problem, "front", [](const Vec3& x) { return x[1] == 0.0; },
      forward::NormalDisplacement{0.0});
  add_condition(
      problem, "back", [width](const Vec3& x) { return x[1] == width; },
      forward::NormalDisplacement{0.0});
  problem.groups["bottom"] = faces_where(problem.mesh, [](const Vec3& x) { return x[2] == 0.0; });
  // So stiff that what the penalty leaves, 2e-5 of the displacement, stays below every other
  // error.
  const double penalty = 100.0 * kYoungs;
  problem.contacts.push_back(
      {"floor", "bottom", contact::RigidPlane{Vec3(0, 0, -kGap), Vec3::UnitZ()}, penalty});
  const auto solution = solved(problem);

  SignoriniErrors errors;
  double squares = 0.0, scale = 0.0;
  for (int e = 0; e < solution.space.num_elements(); ++e) {
    const double volume = fem::tet_geometry(problem.mesh, e).volume;
    for (const fem::TetPoint& point : fem::fine_tet_rule()) {
      Vec3 x = Vec3::Zero();
      for (int k = 0; k < 4; ++k) x += point.l[k] * problem.mesh.nodes.col(problem.mesh.tets(k, e));
      const Vec3 u = Manufactured::displacement(x);
      const Vec3 found = fem::displacement_at(solution.space, solution.displacement, e, point.l);
      squares += point.weight * volume * (found - u).squaredNorm();
      scale += point.weight * volume * (u + kGap * Vec3::UnitZ()).squaredNorm();
    }
  }
  errors.displacement_pct = 100.0 * std::sqrt(squares / scale);
  const double peak = exact.pressure(Vec3::Zero());
  for (const NodeIndex n : problem.groups["bottom"].vertices) {
    const Vec3 x = problem.mesh.nodes.col(n);
    if (x[0] == 0.0 || x[0] == kHeight) continue;  // prescribed: no contact pressure of its own
    errors.pressure_pct =
        std::max(errors.pressure_pct,
                 100.0 * std::abs(solution.contact_pressure[n] - exact.pressure(x)) / peak);
  }
  errors.end_mm = solution.contacts[0].area_mm2 / width;
  return errors;
}

// P1 must converge with order 2 in L2. The second derivatives of the solution jump at x0, so P2
// cannot reach its order 3 on meshes without a node there; 2.5 is what such a solution allows.
// The pressure falls to zero with zero slope at x0, so its end is known to about an element only.
TEST(Signorini, ManufacturedContactThatEndsInsideTheFloorConverges) {
  constexpr char kSource[] = "manufactured solution of frictionless contact";
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    const std::string name = name_of(element);
    std::vector<SignoriniErrors> errors;
    for (const int cells : {4, 8, 16}) {
      errors.push_back(manufactured(element, cells));
      test_support::record({"signorini", name + " manufactured", "element size mm", "error %",
                            kHeight / cells, errors.back().displacement_pct});
    }
    const SignoriniErrors& fine = errors[2];
    const double order = std::log2(errors[1].displacement_pct / fine.displacement_pct);
    const double least = element == fem::Element::kP1 ? 1.75 : 2.25;
    const double most = element == fem::Element::kP1 ? 1.0 : 0.15;
    const auto text = [](double bound) { return std::to_string(bound).substr(0, 4); };
    EXPECT_TRUE(test_support::record_check("signorini", name + " manufactured order", order,
                                           ">= " + text(least), order >= least, kSource));
    EXPECT_TRUE(test_support::record_check("signorini", name + " manufactured displacement error %",
                                           fine.displacement_pct, "<= " + text(most),
                                           fine.displacement_pct <= most, kSource));
    EXPECT_TRUE(test_support::record_check("signorini", name + " manufactured pressure error %",
                                           fine.pressure_pct, "<= 5", fine.pressure_pct <= 5.0,
                                           kSource));
    EXPECT_LT(fine.pressure_pct, 0.7 * errors[1].pressure_pct);
    EXPECT_NEAR(fine.end_mm, Manufactured::kEnd, 1.5 * kHeight / 16);
  }
}

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

// Both elements hold the exact solution, so what is left is the penalty alone. It is a spring in
// series with the block: E (d - g - P) / H = kappa P for the penetration P.
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
      const double kappa = forward::default_penalty(problem, problem.groups["bottom"]);
      const double left = (kPush - kGap) / (1.0 + kappa * kHeight / kYoungs);
      EXPECT_NEAR(solution.contacts[0].max_penetration_mm, left, 1e-9 * kPush);
      EXPECT_NEAR(solution.contacts[0].force[2], kappa * left * kHeight * kHeight,
                  1e-9 * kYoungs * kHeight * kHeight);
      const double found = (kPush - kGap - left) / kHeight;
      EXPECT_LT(block_error(problem, solution.displacement, kGap + left, found), 1e-6);
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
