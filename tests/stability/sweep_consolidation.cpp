// SPDX-License-Identifier: GPL-3.0-or-later
// One backward-Euler step of consolidation: permeability over what tissues and gels have and far
// beyond, step over 12 decades. The reference is a dense factor with full pivoting in long double
// of the matrix that the product assembles for the right problem, which tests/verification holds
// against Terzaghi, Mandel and Cryer.
//
// Faults: sign    the pressure on one node pulls
//         normal  it is turned by 0.2 rad
//         scale   the shear modulus is 1 % too large
#include <Eigen/LU>

#include "common/core/units.hpp"
#include "common/fem/biot.hpp"
#include "common/fem/deformation.hpp"
#include "tests/stability/linear_body.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

constexpr int kCells = 3;
constexpr double kStress = 1e-4;  // N/mm^2, on the top

struct Block {
  LinearBody body = standing_block(kCells);
  std::vector<NodeIndex> drained;  // its top
  Points load;

  Block() {
    const TetMesh& mesh = body.mesh;
    const double top = mesh.nodes.row(2).maxCoeff();
    load = Points::Zero(3, mesh.num_nodes());
    for (NodeIndex node = 0; node < mesh.num_nodes(); ++node) {
      if (mesh.nodes(2, node) < top) continue;
      drained.push_back(node);
      load(2, node) = -kStress * top * top / ((kCells + 1.0) * (kCells + 1.0));
    }
  }
};

fem::PoroMaterial brain(double permeability_m3_s_kg, double storage_per_pa) {
  fem::PoroMaterial material;
  material.elastic = fem::elasticity_from(Material{});
  material.permeability = units::permeability_from_m3_s_kg(permeability_m3_s_kg);
  material.storage = storage_per_pa * 1e6;
  return material;
}

// u and p of the step from rest, and the condition number of the matrix scaled to a unit diagonal
// (1-norm).
struct Exact {
  VectorR displacement;  // 3n
  VectorR pressure;      // n
  double condition = 0.0;
};
Exact exact_step(const Block& block, const fem::PoroMaterial& material, double dt_s) {
  const TetMesh& mesh = block.body.mesh;
  const fem::PressureMap pressure(mesh.num_nodes(), block.drained);
  const fem::BiotMatrix biot = fem::assemble_biot(
      mesh, fem::MaterialMap::uniform(material, mesh.num_tets()), block.body.dofs, pressure, dt_s);
  MatrixR matrix = MatrixR(Eigen::MatrixXd(biot.lower).cast<Real>());
  matrix = MatrixR(matrix.selfadjointView<Eigen::Lower>());
  const VectorR scale = matrix.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  matrix = scale.asDiagonal() * matrix * scale.asDiagonal();
  VectorR right = VectorR::Zero(matrix.rows());
  const Unknowns unknowns = unknowns_of(block.body.dofs);
  right.head(biot.displacement_unknowns) = unknowns.restrict_to(
      Eigen::Map<const VecX>(block.load.data(), block.load.size()).cast<Real>());
  const Eigen::FullPivLU<MatrixR> factor(matrix);
  const VectorR x = scale.asDiagonal() * factor.solve(scale.asDiagonal() * right);
  Exact exact;
  exact.displacement = unknowns.expand(x.head(biot.displacement_unknowns));
  exact.pressure = VectorR::Zero(mesh.num_nodes());
  for (NodeIndex node = 0; node < mesh.num_nodes(); ++node) {
    const int k = pressure.unknown[static_cast<std::size_t>(node)];
    if (k >= 0) exact.pressure[node] = x[biot.displacement_unknowns + k];
  }
  const auto norm = [](const MatrixR& m) {
    return static_cast<double>(m.cwiseAbs().colwise().sum().maxCoeff());
  };
  exact.condition = norm(matrix) * norm(factor.inverse());
  return exact;
}

void one_step(const Block& block, const fem::PoroMaterial& material, double dt_s, Point point,
              const Options& options) {
  point.sheet = "consolidation";
  point.unit = "relative";
  const TetMesh& mesh = block.body.mesh;
  fem::PoroMaterial given = material;
  if (options.fault == Fault::kScale) given.elastic.shear *= 1.01;
  auto stepper = fem::BiotStepper::build(mesh, fem::MaterialMap::uniform(given, mesh.num_tets()),
                                         block.body.dofs, block.drained);
  if (!stepper) return options.record_refused(stepper.error(), point);
  fem::BiotLoad load;
  load.force = block.load;
  auto force = load.force.col(block.drained.front());
  if (options.fault == Fault::kSign) force = -force;
  if (options.fault == Fault::kNormal) force = turned(force);
  const auto state = stepper->step(fem::BiotState::at_rest(mesh.num_nodes()), load, dt_s);
  if (!state) return options.record_refused(state.error(), point);
  point.answered = true;
  point.status = "solved";
  point.backward_error = stepper->diagnostics().backward_error;
  point.rcond = stepper->diagnostics().rcond;
  point.iterations = 1 + stepper->diagnostics().refinements;
  point.min_volume_ratio = fem::measure_deformation(mesh, state->displacement).min_volume_ratio;
  const Exact exact = exact_step(block, material, dt_s);
  // Pressure in units of the load: drained, it vanishes.
  const double pressure = static_cast<double>(
      (state->pressure.cast<Real>() - exact.pressure).cwiseAbs().maxCoeff() / Real(kStress));
  point.difference =
      std::max(relative_difference(state->displacement, exact.displacement), pressure);
  point.bound = rounding_bound(exact.condition);
  options.record(point);
}

}  // namespace

void sweep_consolidation(const Options& options) {
  const Block block;
  Point point;
  point.parameter = "permeability (m3 s/kg)";
  for (const double permeability : thinned(decades(-14, -3), options.grid)) {
    point.x = permeability;
    for (const double dt_s : {1e-2, 1.0, 60.0}) {
      point.row = "step of " + std::to_string(dt_s).substr(0, 4) + " s";
      one_step(block, brain(permeability, 0.0), dt_s, point, options);
    }
  }
  point.parameter = "time step (s)";
  for (const double dt_s : thinned(decades(-6, 6), options.grid)) {
    point.x = dt_s;
    point.row = "incompressible constituents";
    one_step(block, brain(1e-7, 0.0), dt_s, point, options);
    point.row = "compressible constituents";
    one_step(block, brain(1e-7, 1e-5), dt_s, point, options);
  }
}

}  // namespace brainshift::stability
