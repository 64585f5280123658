// SPDX-License-Identifier: GPL-3.0-or-later
// Cryer's sphere (Cryer 1963, Q. J. Mech. Appl. Math. 16:401; Verruijt 2016, section 4.3): radius
// R, surface drained and loaded with pressure q from t = 0. With incompressible constituents,
//   e = (1 - nu) / (1 - 2 nu),   T = c_v t / R^2,   (1 - e x_j^2 / 2) tan x_j = x_j
//   p(centre) = q e sum_j (sin x_j - x_j) / ((e - 1) sin x_j + e x_j cos x_j / 2) exp(-x_j^2 T)
// One eighth of the ball, its planes of symmetry fixed along their normals and sealed.
#include <cmath>
#include <numbers>

#include "common/linalg/cholesky.hpp"
#include "tests/support/results.hpp"
#include "tests/support/study_record.hpp"
#include "tests/verification/poro_column.hpp"

namespace brainshift::fem {
namespace {

using test_support::record_check;
constexpr double kPi = std::numbers::pi;
constexpr double kRadius = 10.0, kLoad = 1e-4;
constexpr const char* kCryerSource = "Cryer 1963; Verruijt 2016 section 4.3";

double cryer_series(double poisson_ratio, double time) {
  const double e = (1.0 - poisson_ratio) / (1.0 - 2.0 * poisson_ratio);
  double sum = 0.0;
  for (int j = 0; j < 200; ++j) {
    double low = j * kPi + 1e-3, high = (j + 1) * kPi;
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
  auto stepper = value_or_fail(
      BiotStepper::build(mesh, MaterialMap::uniform(material, mesh.num_tets()), dofs, drained));
  BiotState state = BiotState::at_rest(mesh.num_nodes());
  const double scale_s = kRadius * kRadius / consolidation_coefficient(material);
  const std::string name = std::to_string(cells) + " cells";
  Course course;
  double time = 0.0;
  for (const double until : {0.005, 0.02, 0.04, 0.07, 0.12, 0.2, 0.35}) {
    advance(stepper, state, load, (until - time) / 30.0 * scale_s, 30);
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

// Mandel's problem (Mandel 1953; Cheng and Detournay 1988, Int. J. Numer. Anal. Methods Geomech.
// 12:551): a slab of half-width a between rigid frictionless plates, loaded with force F per unit
// thickness on its half from t = 0, drained at x = a. With incompressible constituents,
//   T = c_v t / a^2,   tan(w_i) = (1 - nu) / (1/2 - nu) w_i
//   p = F / a sum_i sin w_i / (w_i - sin w_i cos w_i) (cos(w_i x / a) - cos w_i) exp(-w_i^2 T)
// The pressure at the centre first rises above F / (2a): the drained rim shrinks, and the stiff
// plate hands its load inwards (the Mandel-Cryer effect).
//
// The plate is tied by superposition: each step is solved for two displacements of the plate, and
// the combination whose reaction is F is the answer; no series enters.

constexpr double kHalfWidth = 10.0, kHeight = 1.0, kDepth = 1.0;  // mm
constexpr double kPlateForce = 1e-3;                              // N, on the half slab
constexpr const char* kMandelSource = "Mandel 1953; Cheng and Detournay 1988";

std::vector<double> roots(double poisson_ratio) {
  const double slope = (1.0 - poisson_ratio) / (0.5 - poisson_ratio);
  std::vector<double> list;
  for (int i = 0; i < 200; ++i) {
    double low = i * kPi + 1e-9, high = i * kPi + kPi / 2.0;
    for (int k = 0; k < 100; ++k) {
      const double w = 0.5 * (low + high);
      // sin w - slope w cos w is negative left of the root, positive right of it; its sign
      // alternates with i.
      const double f = (std::sin(w) - slope * w * std::cos(w)) * (i % 2 == 0 ? 1.0 : -1.0);
      (f < 0.0 ? low : high) = w;
    }
    list.push_back(0.5 * (low + high));
  }
  return list;
}

double mandel_series(const std::vector<double>& w, double x, double time) {  // p a / F
  double sum = 0.0;
  for (const double r : w) {
    sum += std::sin(r) / (r - std::sin(r) * std::cos(r)) *
           (std::cos(r * x / kHalfWidth) - std::cos(r)) * std::exp(-r * r * time);
  }
  return sum;
}

class Slab {
 public:
  Slab(int cells, const PoroMaterial& material)
      : mesh_(test_support::box_mesh(cells, 1, 1, Vec3(kHalfWidth, kDepth, kHeight))) {
    // Finer towards the drained side.
    for (int n = 0; n < mesh_.num_nodes(); ++n) {
      const double s = mesh_.nodes(0, n) / kHalfWidth;
      mesh_.nodes(0, n) = kHalfWidth * std::sin(0.5 * kPi * s);
    }
    DofMap dofs(mesh_.num_nodes());
    std::vector<NodeIndex> drained;
    for (int n = 0; n < mesh_.num_nodes(); ++n) {
      const Vec3 x = mesh_.nodes.col(n);
      if (x[0] == 0.0) dofs.fix_component(n, 0);
      dofs.fix_component(n, 1);
      if (x[2] == 0.0 || x[2] == kHeight) dofs.fix_component(n, 2);
      if (x[2] == kHeight) plate_.push_back(n);
      if (x[0] > kHalfWidth - 1e-9) drained.push_back(n);
      if (x[1] == 0.0 && x[2] == 0.0) axis_.push_back(n);
    }
    dofs.finalise();
    stepper_.push_back(value_or_fail(BiotStepper::build(
        mesh_, MaterialMap::uniform(material, mesh_.num_tets()), dofs, drained)));
    state_ = BiotState::at_rest(mesh_.num_nodes());
  }

  void advance(double dt_s, int steps) {
    for (int i = 0; i < steps; ++i) {
      const auto low = with_plate_at(-0.0, dt_s), high = with_plate_at(-1e-2, dt_s);
      ASSERT_TRUE(low.has_value() && high.has_value());
      const double f0 = plate_force(*low), f1 = plate_force(*high);
      const double share = (kPlateForce - f0) / (f1 - f0);
      state_.displacement = low->displacement + share * (high->displacement - low->displacement);
      state_.pressure = low->pressure + share * (high->pressure - low->pressure);
    }
  }
  // Pushing down, N.
  double plate_force(const BiotState& state) const {
    const Points force = stepper_[0].internal_force(state);
    double sum = 0.0;
    for (const NodeIndex n : plate_) sum -= force(2, n);
    return sum;
  }
  const BiotState& state() const { return state_; }
  const TetMesh& mesh() const { return mesh_; }
  const std::vector<NodeIndex>& axis() const { return axis_; }

 private:
  Result<BiotState> with_plate_at(double displacement_mm, double dt_s) {
    BiotLoad load;
    load.displacement = Points::Zero(3, mesh_.num_nodes());
    for (const NodeIndex n : plate_) load.displacement(2, n) = displacement_mm;
    return stepper_[0].step(state_, load, dt_s);
  }
  TetMesh mesh_;
  std::vector<NodeIndex> plate_, axis_;
  std::vector<BiotStepper> stepper_;
  BiotState state_;
};

TEST(Mandel, PressureFollowsTheSeriesAndRisesFirst) {
  constexpr double kPoisson = 0.2;
  const PoroMaterial material = tissue(kPoisson);
  const double scale_s = kHalfWidth * kHalfWidth / consolidation_coefficient(material);
  const auto w = roots(kPoisson);
  EXPECT_NEAR(mandel_series(w, 0.0, 1e-5), 0.5, 1e-3);  // undrained: F / (2 a)

  Slab slab(40, material);
  double time = 0.0, error = 0.0, peak = 0.0, series_peak = 0.0;
  for (const double until : {0.001, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2}) {
    slab.advance((until - time) / 60.0 * scale_s, 60);
    time = until;
    EXPECT_NEAR(slab.plate_force(slab.state()), kPlateForce, 1e-9 * kPlateForce);
    const double centre = slab.state().pressure[slab.axis()[0]] * kHalfWidth * kDepth / kPlateForce;
    peak = std::max(peak, centre);
    series_peak = std::max(series_peak, mandel_series(w, 0.0, time));
    test_support::record({"mandel", "centre", "T", "p a / F", time, centre});
    test_support::record(
        {"mandel", "centre series", "T", "p a / F", time, mandel_series(w, 0.0, time)});
    if (time < 0.02) continue;  // a boundary layer of a few elements
    for (const NodeIndex n : slab.axis()) {
      const double exact = mandel_series(w, slab.mesh().nodes(0, n), time);
      const double found = slab.state().pressure[n] * kHalfWidth * kDepth / kPlateForce;
      error = std::max(error, std::abs(found - exact) / 0.5);
    }
  }
  ASSERT_GT(error, 1e-6);
  EXPECT_TRUE(record_check("mandel", "largest error of pressure over its initial value", error,
                           "<= 1 %", error <= 0.01, kMandelSource));
  EXPECT_TRUE(record_check("mandel", "peak at the centre over the initial pressure", peak / 0.5,
                           "> 1.05; series " + std::to_string(series_peak / 0.5),
                           peak / 0.5 > 1.05 && std::abs(peak / series_peak - 1.0) < 0.01,
                           kMandelSource));
}

// Terzaghi's column (Terzaghi 1923; Verruijt 2016, Theory and Problems of Poroelasticity, section
// 2.2): height H, load q from t = 0, drained at the top. With incompressible constituents, y the
// depth below the top, T = c_v t / H^2:
//   p = q sum_m 4 / ((2m+1) pi) sin((2m+1) pi y / 2H) exp(-(2m+1)^2 pi^2 T / 4)
//   settlement = q H / (lambda + 2 G) (1 - sum_m 8 / ((2m+1)^2 pi^2) exp(-(2m+1)^2 pi^2 T / 4))

constexpr double kPressedLoad = 1e-4;  // N/mm^2
constexpr const char* kTerzaghiSource = "Terzaghi 1923; Verruijt 2016 section 2.2";

double series_pressure(double depth, double time) {
  double sum = 0.0;
  for (int m = 0; m < 400; ++m) {
    const double k = 2 * m + 1;
    sum += 4.0 / (k * kPi) * std::sin(k * kPi * depth / (2.0 * Column::kHeight)) *
           std::exp(-k * k * kPi * kPi * time / 4.0);
  }
  return sum;
}

double series_settlement(double time) {
  double sum = 0.0;
  for (int m = 0; m < 400; ++m) {
    const double k = 2 * m + 1;
    sum += 8.0 / (k * k * kPi * kPi) * std::exp(-k * k * kPi * kPi * time / 4.0);
  }
  return 1.0 - sum;
}

double time_scale_s(const PoroMaterial& material) {  // H^2 / c_v
  return Column::kHeight * Column::kHeight / consolidation_coefficient(material);
}
double drained_settlement_mm(const PoroMaterial& material) {
  return kPressedLoad * Column::kHeight / (material.elastic.lambda + 2.0 * material.elastic.shear);
}

TEST(Terzaghi, PressureAndSettlementFollowTheSeries) {
  const PoroMaterial material = tissue(0.46);
  const Column column(80, kPressedLoad);
  BiotStepper stepper = column.stepper(material);
  const double scale_s = time_scale_s(material);
  BiotState state = BiotState::at_rest(column.mesh.num_nodes());
  // Steps of a hundredth of the time that they reach, so that the error in time stays below that
  // in space.
  double time = 0.0, pressure_error = 0.0, settlement_error = 0.0;
  for (const double until : {0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0}) {
    const double dt = (until - time) / 100.0;
    advance(stepper, state, column.load, dt * scale_s, 100);
    time = until;
    if (time < 0.02) continue;  // the boundary layer is still thin
    const std::string series = "T = " + std::to_string(time).substr(0, 4);
    for (const NodeIndex n : column.axis) {
      const double depth = Column::kHeight - column.mesh.nodes(2, n);
      const double exact = series_pressure(depth, time);
      pressure_error = std::max(pressure_error, std::abs(state.pressure[n] / kPressedLoad - exact));
      test_support::record({"terzaghi", series, "depth / H", "pressure / q",
                            depth / Column::kHeight, state.pressure[n] / kPressedLoad});
      test_support::record({"terzaghi", series + " series", "depth / H", "pressure / q",
                            depth / Column::kHeight, exact});
    }
    const double settled = -state.displacement(2, column.top[0]) / drained_settlement_mm(material);
    settlement_error =
        std::max(settlement_error, std::abs(settled / series_settlement(time) - 1.0));
  }
  ASSERT_GT(pressure_error, 1e-6);  // not exact by accident
  EXPECT_TRUE(record_check("terzaghi", "largest error of pressure over q", pressure_error, "<= 1 %",
                           pressure_error <= 0.01, kTerzaghiSource));
  EXPECT_TRUE(record_check("terzaghi", "largest relative error of settlement", settlement_error,
                           "<= 1 %", settlement_error <= 0.01, kTerzaghiSource));
}

// A load that ramps up smoothly, so that the order of the time steps shows from the start.
double ramped_settlement_mm(int steps) {
  const PoroMaterial material = tissue(0.46);
  const Column column(20, kPressedLoad);
  BiotStepper stepper = column.stepper(material, {.stabilise = false});
  BiotState state = BiotState::at_rest(column.mesh.num_nodes());
  const double dt = 0.2 * time_scale_s(material) / steps;
  for (int i = 1; i <= steps; ++i) {
    BiotLoad load;
    load.force = column.load.force * std::pow(std::sin(0.5 * kPi * i / steps), 2);
    advance(stepper, state, load, dt, 1);
  }
  return -state.displacement(2, column.top[0]);
}

TEST(Terzaghi, BackwardEulerHasOrderOneInTheStep) {
  const double reference = ramped_settlement_mm(2560);
  double before = 0.0;
  for (const int steps : {10, 20, 40, 80}) {
    const double error = std::abs(ramped_settlement_mm(steps) / reference - 1.0);
    test_support::record({"terzaghi-step", "backward Euler", "time steps", "relative error",
                          static_cast<double>(steps), error});
    ASSERT_GT(error, 1e-7);
    if (before > 0.0) {
      const double order = std::log2(before / error);
      EXPECT_TRUE(record_check(
          "terzaghi-step", "order from " + std::to_string(steps / 2) + " steps", order,
          "0.9 to 1.15", order > 0.9 && order < 1.15, "Richardson against 2560 steps"));
    }
    before = error;
  }
}

// Rise and fall of the pressure along the column beyond a monotone profile, over q.
double roughness(double step_over_bound, bool stabilise) {
  const PoroMaterial material = tissue(0.46);
  const Column column(20, kPressedLoad);
  BiotStepper stepper = column.stepper(material, {.stabilise = stabilise});
  BiotState state = BiotState::at_rest(column.mesh.num_nodes());
  // The bound of the layer height, the direction in which it flows.
  const double layer = Column::kHeight / 20.0;
  const double bound_s = layer * layer / (6.0 * consolidation_coefficient(material));
  advance(stepper, state, column.load, step_over_bound * bound_s, 1);
  EXPECT_EQ(stepper.diagnostics().stabilised_tets > 0, stabilise);
  double travelled = 0.0;
  for (std::size_t i = 1; i < column.axis.size(); ++i) {
    travelled += std::abs(state.pressure[column.axis[i]] - state.pressure[column.axis[i - 1]]);
  }
  return (travelled - kPressedLoad) / kPressedLoad;
}

TEST(Terzaghi, StabilisedPressureIsSmoothBelowTheStepOfVermeerAndVerruijt) {
  for (const double fraction : {0.001, 0.02}) {
    const double plain = roughness(fraction, false);
    const double stabilised = roughness(fraction, true);
    test_support::record(
        {"pressure-roughness", "plain", "step over bound", "roughness", fraction, plain});
    test_support::record(
        {"pressure-roughness", "stabilised", "step over bound", "roughness", fraction, stabilised});
    ASSERT_GT(plain, 0.3) << fraction;
    EXPECT_TRUE(record_check(
        "pressure-roughness",
        "stabilised over plain at " + std::to_string(fraction) + " of the bound",
        stabilised / plain, "<= 0.1", stabilised <= 0.1 * plain, "White and Borja 2008"));
  }
}

TEST(Terzaghi, LongAfterTheLoadItIsDrainedElasticity) {
  const PoroMaterial material = tissue(0.3);
  const TetMesh mesh = test_support::box_mesh(4, 4, 4, Vec3::Constant(10.0));
  DofMap dofs(mesh.num_nodes());
  const auto surface = [](const Vec3& x) { return x.minCoeff() == 0.0 || x.maxCoeff() == 10.0; };
  const auto floor = [](const Vec3& x) { return x[2] == 0.0; };
  for (const NodeIndex n : test_support::nodes_where(mesh, floor)) dofs.fix_all(n);
  dofs.finalise();
  BiotLoad load;
  load.force = Points::Constant(3, mesh.num_nodes(), 1e-4);
  auto stepper =
      value_or_fail(BiotStepper::build(mesh, MaterialMap::uniform(material, mesh.num_tets()), dofs,
                                       test_support::nodes_where(mesh, surface)));
  const double relaxation_s = 100.0 / consolidation_coefficient(material);
  const auto late =
      value_or_fail(stepper.step(BiotState::at_rest(mesh.num_nodes()), load, 1e10 * relaxation_s));
  EXPECT_EQ(stepper.diagnostics().stabilised_tets, 0);
  const auto factor =
      linalg::SparseCholesky::factorise(assemble_stiffness(mesh, material.elastic, dofs));
  const Points drained = dofs.expand(factor->solve(dofs.restrict_to(load.force)));
  const double difference =
      (late.displacement - drained).cwiseAbs().maxCoeff() / drained.cwiseAbs().maxCoeff();
  EXPECT_TRUE(record_check("drained-limit", "difference to drained elasticity at 1e10 R^2/c_v",
                           difference, "<= 1e-9", difference <= 1e-9, "common/fem/elasticity.hpp"));
  EXPECT_LT(late.pressure.cwiseAbs().maxCoeff(), 1e-9 * kPressedLoad);
}

}  // namespace
}  // namespace brainshift::fem
