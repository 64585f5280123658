// SPDX-License-Identifier: GPL-3.0-or-later
// Displacements far beyond small strain, and bodies that are hardly held.
#include "common/linalg/checked_solve.hpp"
#include "tests/stability/linear_body.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

void large_displacements(const Options& options) {
  auto problem = ToyProblem::make(stability_config(), options.fault);
  const std::vector<double> grid = {0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 40.0, 60.0, 100.0, 200.0};
  for (const double largest_mm : thinned(grid, options.grid)) {
    for (const double direction : {1.0, -1.0}) {
      const std::string way = direction > 0.0 ? ", sinking" : ", rising";
      Point point;
      point.sheet = "load";
      point.parameter = "largest displacement without contact (mm)";
      point.x = largest_mm;
      point.row = "contact from an empty set" + way;
      solve_and_record(*problem, sagging_load(*problem, direction * largest_mm), point, options);
      const auto data =
          sagging_data(*problem, {.largest_mm = direction * largest_mm, .noise_mm = 0.1});
      if (!data) {
        set_refused(data.error(), point);
        options.record(point);
        continue;
      }
      for (const Method method : {Method::kCondensed, Method::kPaper}) {
        point.row = std::string(to_string(method)) + way;
        invert_and_record(*problem, *data, method, point, options);
      }
    }
  }
}

// Nothing is fixed; springs at four corners are all that holds the block.
void nearly_floating(const Options& options) {
  for (const double support : thinned(decades(-18, 0), options.grid)) {
    LinearBody body = standing_block(4);
    body.dofs = fem::DofMap(body.mesh.num_nodes());
    body.dofs.finalise();
    const double stiffness = support * linalg::max_norm(fem::assemble_stiffness(
                                           body.mesh, body.materials.front(), body.dofs));
    for (const NodeIndex node : {0, 4, 20, 124}) body.springs.emplace_back(node, stiffness);
    Point point;
    point.sheet = "load";
    point.parameter = "stiffness of support over body";
    point.x = support;
    point.row = "one solve: four springs";
    solve_linear(body, point, options);
    body.springs.resize(2);  // free to turn about their line
    point.row = "one solve: two springs";
    solve_linear(body, point, options);
  }
}

}  // namespace

void sweep_load(const Options& options) {
  large_displacements(options);
  nearly_floating(options);
}

}  // namespace brainshift::stability
