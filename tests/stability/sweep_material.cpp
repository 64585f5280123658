// SPDX-License-Identifier: GPL-3.0-or-later
// Poisson's ratio to 0.4999, shear modulus over what a case file allows, tumour against brain
// over ten decades.
//
// Linear tetrahedra lock above 0.48, whatever the solver: there an estimate must warn. (quadratic
// ones: sweep_elements.cpp)
#include "tests/stability/linear_body.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

void one_patient(const CaseConfig& config, Point point, const Options& options) {
  auto problem = ToyProblem::make(config, options.fault);
  if (!problem) {
    set_refused(problem.error(), point);
    return options.record(point);
  }
  Point solve = point;
  solve.row = "contact from an empty set";
  solve.must_warn = false;  // the discrete problem is solved all the same
  solve_and_record(*problem, sagging_load(*problem, 8.0), solve, options);
  const auto data = sagging_data(*problem, {});
  if (!data) {
    set_refused(data.error(), point);
    return options.record(point);
  }
  for (const Method method : {Method::kCondensed, Method::kPaper}) {
    invert_and_record(*problem, *data, method, point, options);
  }
}

void poisson_ratio(const Options& options) {
  const std::vector<double> grid = {0.0,  0.1,   0.2,  0.3,   0.4,   0.45,   0.46,  0.47,
                                    0.48, 0.485, 0.49, 0.495, 0.499, 0.4995, 0.4999};
  for (const double nu : thinned(grid, options.grid)) {
    CaseConfig config = stability_config();
    config.material.poisson_ratio = nu;
    Point point;
    point.sheet = "material";
    point.parameter = "0.5 - Poisson's ratio (linear tetrahedra)";
    point.x = 0.5 - nu;  // the ratios crowd near 0.5
    point.must_warn = nu > 0.48;
    one_patient(config, point, options);
  }
}

void shear_modulus(const Options& options) {
  for (const double shear_pa : thinned({1e2, 1e3, 1e4, 1e5, 1e6}, options.grid)) {
    CaseConfig config = stability_config();
    config.material.shear_modulus_pa = shear_pa;
    // As stiff against the skull as Table 1's tissue, as heavy against its stiffness.
    config.contact.penalty_n_per_mm *= shear_pa / 2100.0;
    config.prior.force_density_sd_n_m3 *= shear_pa / 2100.0;
    Point point;
    point.sheet = "material";
    point.parameter = "shear modulus (Pa)";
    point.x = shear_pa;
    one_patient(config, point, options);
  }
}

void tumour_contrast(const Options& options) {
  for (const double ratio : thinned(decades(-4, 6), options.grid)) {
    for (const double radius_mm : {10.0, 20.0}) {
      LinearBody body = standing_block(5);
      const fem::Elasticity brain = body.materials.front();
      body.materials.assign(static_cast<std::size_t>(body.mesh.num_tets()), brain);
      for (int t = 0; t < body.mesh.num_tets(); ++t) {
        Vec3 centre = Vec3::Zero();
        for (int k = 0; k < 4; ++k) centre += 0.25 * body.mesh.nodes.col(body.mesh.tets(k, t));
        if ((centre - Vec3(30, 30, 40)).norm() > radius_mm) continue;
        body.materials[static_cast<std::size_t>(t)] = {ratio * brain.lambda, ratio * brain.shear};
      }
      Point point;
      point.sheet = "material";
      point.parameter = "stiffness of tumour over brain";
      point.x = ratio;
      point.row = "one solve: tumour of " + std::to_string(static_cast<int>(radius_mm)) + " mm";
      solve_linear(body, point, options);
    }
  }
}

}  // namespace

void sweep_material(const Options& options) {
  poisson_ratio(options);
  shear_modulus(options);
  tumour_contrast(options);
}

}  // namespace brainshift::stability
