// SPDX-License-Identifier: GPL-3.0-or-later
// Warm starts from the wrong set: each update begins with the contact of another surgery, up to
// hundreds of slaves away from its own.
#include <algorithm>
#include <limits>

#include "common/contact/iterative_system.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {

// Contact penalty over 15 decades, all that a case file may ask for: the three ways to apply
// K_p^-1 to one set, contact from an empty set, and inversions.

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
  if (!status) return options.record_refused(status.error(), point);
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
    Point point = point_at("penalty", kParameter, beta);
    auto problem = ToyProblem::make(config, options.fault);
    if (!problem) {
      options.record_refused(problem.error(), point);
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
      options.record_refused(iterative.error(), point);
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

namespace {

double changes(std::vector<NodeIndex> a, std::vector<NodeIndex> b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  std::vector<NodeIndex> differ;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differ));
  return static_cast<double>(differ.size());
}

void follow(ToyProblem& problem, const std::vector<SparseData>& surgeries,
            inversion::CondensedInverter& inverter, const Options& options) {
  std::vector<NodeIndex> before;
  for (const SparseData& data : surgeries) {
    Point point;
    point.sheet = "contact";
    point.parameter = "slaves that change at one update";
    point.row = "condensed, warm start";
    point.unit = "mm";
    point.rcond = problem.model->forward().factor().rcond();
    point.backward_error = std::numeric_limits<double>::quiet_NaN();
    Estimate estimate;
    if (auto status = inverter.update(data, estimate); !status) {
      options.record_refused(status.error(), point);
      continue;
    }
    set_answered(estimate, point);
    point.x = 1.0 + changes(before, estimate.active_slaves);  // a logarithmic axis has no 0
    before = estimate.active_slaves;
    compare_with_posterior(problem, data, estimate, point);
    options.record(point);
  }
}

}  // namespace

void sweep_contact(const Options& options) {
  auto problem =
      ToyProblem::make(stability_config(), options.fault, options.grid == Grid::kFull ? 8 : 5);
  std::vector<SparseData> surgeries;
  const std::vector<double> moves_mm = {8.0, -30.0, 30.0, -8.0, 2.0, -60.0, 1.0, 20.0, -3.0};
  // A fault must not meet a move that leaves its slave open.
  const bool first = options.grid == Grid::kMiddle;
  for (const double move_mm :
       first ? std::vector{moves_mm.front()} : thinned(moves_mm, options.grid)) {
    if (auto data = sagging_data(*problem, {.largest_mm = move_mm})) surgeries.push_back(*data);
  }
  auto operators = inversion::condense(*problem->model);
  auto inverter = inversion::CondensedInverter::build(
      std::make_shared<const CondensedOperators>(std::move(*operators)),
      std::make_shared<const geometry::TetLocator>(problem->brain->mesh), problem->config);
  follow(*problem, surgeries, *inverter, options);
}

}  // namespace brainshift::stability
