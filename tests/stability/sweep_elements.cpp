// SPDX-License-Identifier: GPL-3.0-or-later
// Poisson's ratio to 0.4999 with quadratic tetrahedra, as `brainshift solve` answers it; the
// linear ones beside them must warn above 0.48. The reference is a dense factor in long double of
// the matrix that the product assembles for the right problem, which tests/verification holds
// against closed forms.
//
// Faults: sign    the weight of one tetrahedron points the other way
//         normal  it is turned by 0.2 rad
//         scale   the shear modulus is 1 % too large
#include "common/forward/forward_problem.hpp"
#include "tests/stability/linear_body.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

constexpr double kLocks = 0.48;

forward::ForwardProblem block_under_weight(fem::Element element, double nu) {
  forward::ForwardProblem problem;
  problem.mesh = standing_block(2).mesh;
  problem.element = element;
  Material material;
  material.poisson_ratio = nu;
  fem::PoroMaterial brain;
  brain.elastic = fem::elasticity_from(material);
  problem.materials = fem::MaterialMap::uniform(brain, problem.mesh.num_tets());
  problem.body_force = Points::Zero(3, problem.mesh.num_tets());
  problem.body_force.row(0).setConstant(1e-6);
  problem.body_force.row(2).setConstant(-5e-6);
  forward::FaceGroup floor;
  for (NodeIndex node = 0; node < problem.mesh.num_nodes(); ++node) {
    if (problem.mesh.nodes(2, node) == 0.0) floor.vertices.push_back(node);
  }
  problem.groups["floor"] = floor;
  problem.conditions.push_back({"floor", "floor", forward::Displacement{{0.0, 0.0, 0.0}}});
  return problem;
}

forward::ForwardProblem spoilt(forward::ForwardProblem problem, Fault fault) {
  auto weight = problem.body_force.col(problem.body_force.cols() / 2);
  if (fault == Fault::kSign) weight = -weight;
  if (fault == Fault::kNormal) weight = turned(weight);
  if (fault == Fault::kScale) problem.materials.materials.front().elastic.shear *= 1.01;
  return problem;
}

void one_ratio(fem::Element element, double nu, Point point, const Options& options) {
  point.sheet = "elements";
  point.parameter = "0.5 - Poisson's ratio";
  point.x = 0.5 - nu;  // the ratios crowd near 0.5
  point.unit = "relative";
  point.row = element == fem::Element::kP1 ? "linear tetrahedra" : "quadratic tetrahedra";
  point.must_warn = element == fem::Element::kP1 && nu > kLocks;
  const forward::ForwardProblem problem = block_under_weight(element, nu);
  const auto solution = forward::solve(spoilt(problem, options.fault));
  if (!solution) return options.record_refused(solution.error(), point);
  point.answered = true;
  point.warned = !solution->warnings.empty();
  point.status = "solved";
  if (point.warned) point.reason = solution->warnings.front();
  point.backward_error = solution->relative_residual;
  point.rcond = solution->rcond;
  point.iterations = solution->iterations;
  point.min_volume_ratio = solution->min_jacobian;
  const auto discretised = forward::discretise(problem);
  const fem::ConstrainedDofs constrained = discretised->constraints.build();
  const linalg::SymmetricMatrix lower =
      fem::assemble_stiffness(discretised->space, problem.materials, constrained.dofs);
  MatrixR full = MatrixR(Eigen::MatrixXd(lower).cast<Real>());
  full = MatrixR(full.selfadjointView<Eigen::Lower>());
  const Reference reference(std::move(full), unknowns_of(constrained.dofs));
  point.difference =
      relative_difference(solution->displacement, reference.displacement(discretised->load));
  point.bound = rounding_bound(reference.condition());
  options.record(point);
}

}  // namespace

void sweep_elements(const Options& options) {
  const std::vector<double> grid = {0.0,  0.1,   0.2,  0.3,   0.4,   0.45,   0.46,  0.47,
                                    0.48, 0.485, 0.49, 0.495, 0.499, 0.4995, 0.4999};
  for (const double nu : thinned(grid, options.grid)) {
    one_ratio(fem::Element::kP1, nu, {}, options);
    one_ratio(fem::Element::kP2, nu, {}, options);
  }
  // Beyond what any of them carries: refused.
  one_ratio(fem::Element::kP2, 0.49995, {}, options);
}

}  // namespace brainshift::stability
