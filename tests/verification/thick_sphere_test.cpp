// SPDX-License-Identifier: GPL-3.0-or-later
// Thick sphere under internal pressure, radii a < b (Lame; Timoshenko & Goodier, Theory of Elasticity, art. 142):
//   u_r(r) = p a^3 / (b^3 - a^3) [ (1 - 2 nu) r / E + (1 + nu) b^3 / (2 E r^2) ]
// Near nu = 1/2 the volume hardly changes, and P1 locks while P2 does not.
#include <cmath>

#include "tests/support/ball_mesh.hpp"
#include "tests/support/study_record.hpp"
#include "tests/verification/forward_fixture.hpp"

namespace brainshift::verification {
namespace {

constexpr double kInner = 10.0, kOuter = 20.0, kYoungs = 0.003, kPressure = 1e-4;

double exact(double r, double nu) {
  const double a3 = std::pow(kInner, 3), b3 = std::pow(kOuter, 3);
  return kPressure * a3 / (b3 - a3) * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b3 / (2.0 * r * r)) /
         kYoungs;
}

struct Outcome {
  double error_pct = 0.0;  // of the mean radial displacement of the inner surface
  double edge_mm = 0.0;
  int unknowns = 0;
  double seconds = 0.0;
};

Outcome thick_sphere(fem::Element element, double nu, int cells) {
  std::vector<double> radii;
  const int layers = cells;
  for (int k = 0; k <= layers; ++k)
    radii.push_back(kInner * std::pow(kOuter / kInner, static_cast<double>(k) / layers));
  auto problem =
      problem_on(test_support::octant_mesh(radii, cells), element, elasticity(kYoungs, nu));
  add_symmetry(problem, true);
  const auto inner = [](const Vec3& x) { return x.norm() < kInner * 1.0001; };
  add_condition(problem, "cavity", inner, forward::Pressure{kPressure});
  const auto solution = solved(problem);
  double sum = 0.0;
  const auto& vertices = problem.groups.at("cavity").vertices;
  for (const int v : vertices)
    sum += solution.displacement.col(v).dot(problem.mesh.nodes.col(v)) / kInner;
  const double mean = sum / static_cast<double>(vertices.size());
  return {100.0 * std::abs(mean / exact(kInner, nu) - 1.0), 0.5 * 3.14159 * kInner / cells,
          solution.unknowns, solution.assemble_s + solution.solve_s};
}

TEST(ThickSphere, QuadraticElementsDoNotLock) {
  for (const double nu : {0.3, 0.45, 0.49, 0.499, 0.4999}) {
    for (const auto& [element, sizes] : {std::pair{fem::Element::kP1, std::vector<int>{4, 8, 16}},
                                         std::pair{fem::Element::kP2, std::vector<int>{2, 4, 8}}}) {
      double last = 0.0;
      for (const int cells : sizes) {
        const Outcome outcome = thick_sphere(element, nu, cells);
        test_support::record({"thick-sphere",
                              std::string(name_of(element)) + " nu " + std::to_string(nu),
                              "unknowns", "error of the cavity's radial displacement %",
                              static_cast<double>(outcome.unknowns), outcome.error_pct});
        std::printf("%s nu %.4f cells %2d unknowns %6d error %7.3f %% time %.3f s\n",
                    name_of(element), nu, cells, outcome.unknowns, outcome.error_pct,
                    outcome.seconds);
        last = outcome.error_pct;
      }
      (void)last;
    }
  }
}

}  // namespace
}  // namespace brainshift::verification
