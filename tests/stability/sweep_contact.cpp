// SPDX-License-Identifier: GPL-3.0-or-later
// Warm starts from the wrong set: each update begins with the contact of another surgery, up to
// hundreds of slaves away from its own.
#include <algorithm>

#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
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
      set_refused(status.error(), point);
      options.record(point);
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
