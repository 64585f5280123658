// SPDX-License-Identifier: GPL-3.0-or-later
// Thick sphere under internal pressure, radii a < b (Lame; Timoshenko & Goodier, Theory of Elasticity, art. 142):
//   u_r(r) = p a^3 / (b^3 - a^3) [ (1 - 2 nu) r / E + (1 + nu) b^3 / (2 E r^2) ]
// Near nu = 1/2 the volume hardly changes: P1 locks, P2 does not. What remains of P2's error is the flat faces of the
// cavity, alike for every nu.
#include <cmath>
#include <map>
#include <numbers>

#include "tests/support/ball_mesh.hpp"
#include "tests/support/study_record.hpp"
#include "tests/verification/forward_fixture.hpp"

namespace brainshift::verification {
namespace {

constexpr double kInner = 10.0, kOuter = 20.0, kYoungs = 0.003, kPressure = 1e-4;
constexpr char kStudy[] = "thick-sphere";
constexpr char kSource[] = "Lame: Timoshenko and Goodier art. 142";

double exact(double r, double nu) {
  const double a3 = std::pow(kInner, 3), b3 = std::pow(kOuter, 3);
  return kPressure * a3 / (b3 - a3) * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b3 / (2.0 * r * r)) /
         kYoungs;
}

struct Outcome {
  double error_pct = 0.0;  // of the cavity's mean radial displacement
  int unknowns = 0;
  double seconds = 0.0;
};

Outcome thick_sphere(fem::Element element, double nu, int cells) {
  std::vector<double> radii;
  for (int k = 0; k <= cells; ++k)
    radii.push_back(kInner * std::pow(kOuter / kInner, static_cast<double>(k) / cells));
  auto problem =
      problem_on(test_support::octant_mesh(radii, cells), element, elasticity(kYoungs, nu));
  add_symmetry(problem, true);
  add_condition(
      problem, "cavity", [](const Vec3& x) { return x.norm() < kInner * 1.0001; },
      forward::Pressure{kPressure});
  const auto solution = solved(problem);
  double sum = 0.0;
  const auto& vertices = problem.groups.at("cavity").vertices;
  for (const int v : vertices)
    sum += solution.displacement.col(v).dot(problem.mesh.nodes.col(v)) / kInner;
  const double mean = sum / static_cast<double>(vertices.size());
  return {100.0 * std::abs(mean / exact(kInner, nu) - 1.0), solution.unknowns,
          solution.assemble_s + solution.solve_s};
}

std::string series(fem::Element element, double nu) {
  std::string number = std::to_string(nu);
  number.resize(6);
  return std::string(name_of(element)) + " nu " + number;
}

TEST(ThickSphere, LinearElementsLockAndQuadraticOnesDoNot) {
  std::map<std::pair<fem::Element, double>, Outcome> finest;
  for (const double nu : {0.3, 0.45, 0.48, 0.49, 0.499, 0.4999}) {
    for (const auto& [element, sizes] : {std::pair{fem::Element::kP1, std::vector<int>{4, 8, 16}},
                                         std::pair{fem::Element::kP2, std::vector<int>{2, 4, 8}}}) {
      for (const int cells : sizes) {
        const Outcome outcome = thick_sphere(element, nu, cells);
        test_support::record({kStudy, series(element, nu), "unknowns", "displacement error %",
                              static_cast<double>(outcome.unknowns), outcome.error_pct});
        test_support::record({"thick-sphere-time", series(element, nu), "assembly and solve s",
                              "displacement error %", outcome.seconds, outcome.error_pct});
        finest[{element, nu}] = outcome;
      }
    }
  }
  const Outcome& p1 = finest[{fem::Element::kP1, 0.4999}];
  const Outcome& p2 = finest[{fem::Element::kP2, 0.4999}];
  ASSERT_EQ(p1.unknowns, p2.unknowns);
  EXPECT_TRUE(test_support::record_check(kStudy, "P2 nu 0.4999 displacement error %", p2.error_pct,
                                         "<= 3", p2.error_pct <= 3.0, kSource));
  // Locking: with the same unknowns P1 is several times worse, and worse than itself where it does not lock.
  const double ratio = p1.error_pct / p2.error_pct;
  EXPECT_TRUE(test_support::record_check(kStudy, "P1 error over P2 error at nu 0.4999", ratio,
                                         ">= 4", ratio >= 4.0, kSource));
  const double p1_growth = p1.error_pct / finest[{fem::Element::kP1, 0.3}].error_pct;
  EXPECT_TRUE(test_support::record_check(kStudy, "P1 error at nu 0.4999 over error at 0.3",
                                         p1_growth, ">= 5", p1_growth >= 5.0, kSource));
  const double p2_growth = p2.error_pct / finest[{fem::Element::kP2, 0.3}].error_pct;
  EXPECT_TRUE(test_support::record_check(kStudy, "P2 error at nu 0.4999 over error at 0.3",
                                         p2_growth, "<= 1.2", p2_growth <= 1.2, kSource));
}

}  // namespace
}  // namespace brainshift::verification
