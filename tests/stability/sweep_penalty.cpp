// SPDX-License-Identifier: GPL-3.0-or-later
// Contact penalty over 15 decades, all that a case file may ask for: the three ways to apply
// K_p^-1 to one set, contact from an empty set, and inversions.
#include <limits>

#include "common/contact/iterative_system.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/contact/woodbury_system.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

constexpr const char* kParameter = "contact penalty (N/mm)";

void system_point(ToyProblem& problem, contact::PenalisedSystem& system, const Points& load,
                  Point point, bool iterative, const Options& options) {
  const auto& contact = problem.model->forward().contact();
  contact::ActiveSet active(static_cast<std::size_t>(contact.num_slaves()), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    active[i] = i % 3 == static_cast<std::size_t>(problem.weighty_slaves.front()) % 3;
  }
  point.unit = "relative";
  point.rcond = problem.model->forward().factor().rcond();
  point.backward_error = std::numeric_limits<double>::quiet_NaN();
  Points u(3, 0);
  Status status = system.activate(active);
  if (status) status = system.solve_with_gaps(load, u);
  if (!status) {
    set_refused(status.error(), point);
    return options.record(point);
  }
  point.answered = true;
  point.status = "solved";
  Reference& reference = problem.patient->system;
  reference.activate(active);
  point.difference = relative_difference(u, reference.displacement(load));
  const double condition = reference.condition();
  // An iterative solver stops at its residual, which its options state.
  point.bound = iterative ? std::min(condition * contact::IterativeOptions{}.tolerance, 1e-3)
                          : rounding_bound(condition);
  options.record(point);
}

}  // namespace

void sweep_penalty(const Options& options) {
  // Data of a moderately stiff skull, so that every penalty is asked the same.
  const auto moderate = ToyProblem::make(stability_config(), Fault::kNone);
  const auto data = sagging_data(*moderate, {});
  for (const double beta : thinned(decades(-6, 9), options.grid)) {
    CaseConfig config = stability_config();
    config.contact.penalty_n_per_mm = beta;
    Point point;
    point.sheet = "penalty";
    point.parameter = kParameter;
    point.x = beta;
    auto problem = ToyProblem::make(config, options.fault);
    if (!problem) {
      set_refused(problem.error(), point);
      options.record(point);
      continue;
    }
    const Points load = sagging_load(*problem, 8.0);
    const contact::ForwardModel& forward = problem->model->forward();
    contact::RefactorisedSystem refactorised(forward);
    contact::WoodburySystem woodbury(forward);
    point.row = "one set: refactorised";
    system_point(*problem, refactorised, load, point, false, options);
    point.row = "one set: Woodbury";
    system_point(*problem, woodbury, load, point, false, options);
    point.row = "one set: iterative";
    if (auto iterative = contact::IterativeSystem::build(forward)) {
      system_point(*problem, **iterative, load, point, true, options);
    } else {
      set_refused(iterative.error(), point);
      options.record(point);
    }
    point.row = "contact from an empty set";
    solve_and_record(*problem, load, point, options);

    point.row.clear();
    for (const Method method :
         {Method::kCondensed, Method::kPaper, Method::kPaperWoodbury, Method::kIterativeSolver}) {
      invert_and_record(*problem, *data, method, point, options);
    }
  }
}

}  // namespace brainshift::stability
