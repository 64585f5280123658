// SPDX-License-Identifier: GPL-3.0-or-later
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
#include <cmath>
#include <numbers>

#include "tests/support/study_record.hpp"
#include "tests/verification/poro_column.hpp"

namespace brainshift::fem {
namespace {

using test_support::record_check;
constexpr double kPiMandel = std::numbers::pi;
constexpr double kHalfWidth = 10.0, kHeight = 1.0, kDepth = 1.0;  // mm
constexpr double kPlateForce = 1e-3;                              // N, on the half slab
constexpr const char* kMandelSource = "Mandel 1953; Cheng and Detournay 1988";

std::vector<double> roots(double poisson_ratio) {
  const double slope = (1.0 - poisson_ratio) / (0.5 - poisson_ratio);
  std::vector<double> list;
  for (int i = 0; i < 200; ++i) {
    double low = i * kPiMandel + 1e-9, high = i * kPiMandel + kPiMandel / 2.0;
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
      mesh_.nodes(0, n) = kHalfWidth * std::sin(0.5 * kPiMandel * s);
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
    auto built =
        BiotStepper::build(mesh_, MaterialMap::uniform(material, mesh_.num_tets()), dofs, drained);
    EXPECT_TRUE(built.has_value());
    stepper_.push_back(std::move(*built));
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

}  // namespace
}  // namespace brainshift::fem
