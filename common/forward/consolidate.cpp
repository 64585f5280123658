// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/forward/consolidate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/core/stopwatch.hpp"
#include "common/fem/biot.hpp"

namespace brainshift::forward {
namespace {

void add_stabilised(int step, int tets, double dt_s, double bound_s, ForwardSolution& solution) {
  if (tets == 0) return;
  solution.warnings.push_back(fmt::format(
      "step {} of {:.3g} s: pressure stabilised in {} tetrahedra (steps above {:.3g} s need none)",
      step, dt_s, tets, bound_s));
}

}  // namespace

Result<ForwardSolution> consolidate(const ForwardProblem& problem, Discretised discretised,
                                    const Progress& progress) {
  const Stopwatch watch;
  if (Status ok = check_supports(discretised); !ok) return tl::unexpected(ok.error());
  const fem::ConstrainedDofs constrained = discretised.constraints.build();
  std::vector<NodeIndex> drained;
  fem::BiotLoad load{
      discretised.load, {}, constrained.lift, VecX::Zero(discretised.space.num_nodes())};
  for (const auto& [node, pressure] : discretised.pore_pressure) {
    drained.push_back(node);
    load.pressure[node] = pressure;
  }
  auto stepper =
      fem::BiotStepper::build(problem.mesh, problem.materials, constrained.dofs, drained);
  if (!stepper) return tl::unexpected(stepper.error());
  ForwardSolution solution;
  solution.space = std::move(discretised.space);
  solution.unknowns = constrained.dofs.num_unknowns() + solution.space.num_nodes() -
                      static_cast<int>(drained.size());
  solution.assemble_s = watch.seconds();

  const Stopwatch solve_watch;
  fem::BiotState state = fem::BiotState::at_rest(solution.space.num_nodes());
  solution.rcond = 1.0;
  double time_s = 0.0;
  for (std::size_t k = 0; k < problem.steps_s.size(); ++k) {
    report(progress, "time steps",
           static_cast<double>(k) / static_cast<double>(problem.steps_s.size()));
    const double dt_s = problem.steps_s[k];
    auto next = stepper->step(state, load, dt_s);
    if (!next) {
      return fail(next.error().code,
                  fmt::format("time.steps_s: step {}: {}", k + 1, next.error().message));
    }
    state = std::move(*next);
    time_s += dt_s;
    const fem::BiotDiagnostics& did = stepper->diagnostics();
    solution.relative_residual = std::max(solution.relative_residual, did.backward_error);
    solution.rcond = std::min(solution.rcond, did.rcond);
    if (did.factorised) {
      add_stabilised(static_cast<int>(k + 1), did.stabilised_tets, dt_s, did.largest_bound_s,
                     solution);
    }
    solution.history.push_back({time_s, state.displacement, state.pressure});
  }
  report(progress, "time steps", 1.0);
  solution.iterations = static_cast<int>(problem.steps_s.size());
  solution.solve_s = solve_watch.seconds();

  solution.displacement = state.displacement;
  solution.element_stress =
      fem::element_stress(solution.space, problem.materials, solution.displacement);
  solution.nodal_stress =
      fem::nodal_stress(solution.space, problem.materials, solution.displacement);
  solution.min_jacobian = fem::min_jacobian(solution.space, solution.displacement);
  solution.reaction = -discretised.load.rowwise().sum();
  add_warnings(problem, solution);
  return solution;
}

}  // namespace brainshift::forward
