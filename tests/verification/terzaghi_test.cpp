// SPDX-License-Identifier: GPL-3.0-or-later
// Terzaghi's column (Terzaghi 1923; Verruijt 2016, Theory and Problems of Poroelasticity, section
// 2.2): height H, load q from t = 0, drained at the top. With incompressible constituents, y the
// depth below the top, T = c_v t / H^2:
//   p = q sum_m 4 / ((2m+1) pi) sin((2m+1) pi y / 2H) exp(-(2m+1)^2 pi^2 T / 4)
//   settlement = q H / (lambda + 2 G) (1 - sum_m 8 / ((2m+1)^2 pi^2) exp(-(2m+1)^2 pi^2 T / 4))
#include <cmath>
#include <numbers>

#include "common/linalg/cholesky.hpp"
#include "tests/support/study_record.hpp"
#include "tests/verification/poro_column.hpp"

namespace brainshift::fem {
namespace {

using test_support::record_check;
constexpr double kPiTerzaghi = std::numbers::pi;
constexpr double kPressedLoad = 1e-4;  // N/mm^2
constexpr const char* kTerzaghiSource = "Terzaghi 1923; Verruijt 2016 section 2.2";

double series_pressure(double depth, double time) {
  double sum = 0.0;
  for (int m = 0; m < 400; ++m) {
    const double k = 2 * m + 1;
    sum += 4.0 / (k * kPiTerzaghi) * std::sin(k * kPiTerzaghi * depth / (2.0 * Column::kHeight)) *
           std::exp(-k * k * kPiTerzaghi * kPiTerzaghi * time / 4.0);
  }
  return sum;
}

double series_settlement(double time) {
  double sum = 0.0;
  for (int m = 0; m < 400; ++m) {
    const double k = 2 * m + 1;
    sum += 8.0 / (k * k * kPiTerzaghi * kPiTerzaghi) *
           std::exp(-k * k * kPiTerzaghi * kPiTerzaghi * time / 4.0);
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
    load.force = column.load.force * std::pow(std::sin(0.5 * kPiTerzaghi * i / steps), 2);
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
  auto stepper = BiotStepper::build(mesh, MaterialMap::uniform(material, mesh.num_tets()), dofs,
                                    test_support::nodes_where(mesh, surface));
  ASSERT_TRUE(stepper.has_value());
  const double relaxation_s = 100.0 / consolidation_coefficient(material);
  const auto late = stepper->step(BiotState::at_rest(mesh.num_nodes()), load, 1e10 * relaxation_s);
  ASSERT_TRUE(late.has_value()) << late.error().message;
  EXPECT_EQ(stepper->diagnostics().stabilised_tets, 0);
  const auto factor =
      linalg::SparseCholesky::factorise(assemble_stiffness(mesh, material.elastic, dofs));
  const Points drained = dofs.expand(factor->solve(dofs.restrict_to(load.force)));
  const double difference =
      (late->displacement - drained).cwiseAbs().maxCoeff() / drained.cwiseAbs().maxCoeff();
  EXPECT_TRUE(record_check("drained-limit", "difference to drained elasticity at 1e10 R^2/c_v",
                           difference, "<= 1e-9", difference <= 1e-9, "common/fem/elasticity.hpp"));
  EXPECT_LT(late->pressure.cwiseAbs().maxCoeff(), 1e-9 * kPressedLoad);
}

}  // namespace
}  // namespace brainshift::fem
