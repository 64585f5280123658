// SPDX-License-Identifier: GPL-3.0-or-later
// Cryer's sphere (Cryer 1963, Q. J. Mech. Appl. Math. 16:401; Verruijt 2016, section 4.3): radius
// R, surface drained and loaded with pressure q from t = 0. With incompressible constituents,
//   e = (1 - nu) / (1 - 2 nu),   T = c_v t / R^2,   (1 - e x_j^2 / 2) tan x_j = x_j
//   p(centre) = q e sum_j (sin x_j - x_j) / ((e - 1) sin x_j + e x_j cos x_j / 2) exp(-x_j^2 T)
// One eighth of the ball, its planes of symmetry fixed along their normals and sealed.
#include <cmath>
#include <numbers>

#include "tests/support/study_record.hpp"
#include "tests/verification/poro_column.hpp"

namespace brainshift::fem {
namespace {

using test_support::record_check;
constexpr double kPiCryer = std::numbers::pi;
constexpr double kRadius = 10.0, kLoad = 1e-4;
constexpr const char* kCryerSource = "Cryer 1963; Verruijt 2016 section 4.3";

double cryer_series(double poisson_ratio, double time) {
  const double e = (1.0 - poisson_ratio) / (1.0 - 2.0 * poisson_ratio);
  double sum = 0.0;
  for (int j = 0; j < 200; ++j) {
    double low = j * kPiCryer + 1e-3, high = (j + 1) * kPiCryer;
    const auto f = [&](double x) {
      return (1.0 - e * x * x / 2.0) * std::sin(x) - x * std::cos(x);
    };
    const bool rises = f(high) > f(low);
    for (int k = 0; k < 100; ++k) {
      const double x = 0.5 * (low + high);
      ((f(x) < 0.0) == rises ? low : high) = x;
    }
    const double x = 0.5 * (low + high);
    sum += (std::sin(x) - x) / ((e - 1.0) * std::sin(x) + e * x * std::cos(x) / 2.0) *
           std::exp(-x * x * time);
  }
  return e * sum;
}

// The unit cube's layers |x|_max = const become spherical shells; its three faces at 0 stay
// planes.
TetMesh eighth_of_a_ball(int cells) {
  TetMesh mesh = test_support::box_mesh(cells, cells, cells, Vec3::Ones());
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const Vec3 x = mesh.nodes.col(n);
    const double largest = x.maxCoeff();
    if (largest > 0.0) mesh.nodes.col(n) = kRadius * largest / x.norm() * x;
  }
  return mesh;
}

struct Course {
  double error = 0.0, peak = 0.0, series_peak = 0.0;
};

Course centre_course(int cells, double poisson_ratio) {
  const PoroMaterial material = tissue(poisson_ratio);
  const TetMesh mesh = eighth_of_a_ball(cells);
  DofMap dofs(mesh.num_nodes());
  std::vector<NodeIndex> drained;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      if (mesh.nodes(axis, n) == 0.0) dofs.fix_component(n, axis);
    }
    if (mesh.nodes.col(n).norm() > kRadius * (1.0 - 1e-9)) drained.push_back(n);
  }
  dofs.finalise();
  BiotLoad load;
  load.force = pressure_load(make_space(mesh, Element::kP1), faces_of(mesh, drained), kLoad);
  auto stepper =
      BiotStepper::build(mesh, MaterialMap::uniform(material, mesh.num_tets()), dofs, drained);
  EXPECT_TRUE(stepper.has_value());
  BiotState state = BiotState::at_rest(mesh.num_nodes());
  const double scale_s = kRadius * kRadius / consolidation_coefficient(material);
  const std::string name = std::to_string(cells) + " cells";
  Course course;
  double time = 0.0;
  for (const double until : {0.005, 0.02, 0.04, 0.07, 0.12, 0.2, 0.35}) {
    advance(*stepper, state, load, (until - time) / 30.0 * scale_s, 30);
    time = until;
    const double centre = state.pressure[0] / kLoad;
    const double exact = cryer_series(poisson_ratio, time);
    test_support::record({"cryer", name, "T", "centre pressure / q", time, centre});
    test_support::record({"cryer", "series", "T", "centre pressure / q", time, exact});
    course.error = std::max(course.error, std::abs(centre - exact));
    course.peak = std::max(course.peak, centre);
    course.series_peak = std::max(course.series_peak, exact);
  }
  return course;
}

TEST(Cryer, CentrePressureFollowsTheSeriesAndRisesFirst) {
  constexpr double kPoisson = 0.2;
  EXPECT_NEAR(cryer_series(kPoisson, 1e-4), 1.0, 0.02);  // undrained: q
  const Course coarse = centre_course(7, kPoisson);
  const Course fine = centre_course(14, kPoisson);
  ASSERT_GT(fine.error, 1e-6);
  EXPECT_LT(fine.error, coarse.error);
  EXPECT_TRUE(record_check("cryer", "largest error of the centre pressure over q", fine.error,
                           "<= 1 %", fine.error <= 0.01, kCryerSource));
  EXPECT_TRUE(record_check("cryer", "peak of the centre pressure over q", fine.peak,
                           "> 1.1; series " + std::to_string(fine.series_peak), fine.peak > 1.1,
                           kCryerSource));
}

}  // namespace
}  // namespace brainshift::fem
