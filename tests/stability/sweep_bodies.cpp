// SPDX-License-Identifier: GPL-3.0-or-later
// Poisson's ratio to 0.4999, shear modulus over what a case file allows, tumour against brain
// over ten decades.
//
// Linear tetrahedra lock above 0.48, whatever the solver: there an estimate must warn. (quadratic
// ones: sweep_elements.cpp)

#include "common/linalg/checked_solve.hpp"
#include "tests/stability/linear_body.hpp"
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

void one_patient(const CaseConfig& config, Point point, const Options& options) {
  auto problem = ToyProblem::make(config, options.fault);
  if (!problem) return options.record_refused(problem.error(), point);
  Point solve = point;
  solve.row = "contact from an empty set";
  solve.must_warn = false;  // the discrete problem is solved all the same
  solve_and_record(*problem, sagging_load(*problem, 8.0), solve, options);
  const auto data = sagging_data(*problem, {});
  if (!data) return options.record_refused(data.error(), point);
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
    Point point = point_at("material", "0.5 - Poisson's ratio (linear tetrahedra)",
                           0.5 - nu);  // the ratios crowd near 0.5
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
    Point point = point_at("material", "shear modulus (Pa)", shear_pa);
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
      Point point =
          point_at("material", "stiffness of tumour over brain", ratio,
                   "one solve: tumour of " + std::to_string(static_cast<int>(radius_mm)) + " mm");
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

// Bad elements: one node pressed into the face opposite (slivers) or into a neighbour (needles),
// and layers whose thickness jumps.

namespace {

constexpr int kMeshCells = 4;

NodeIndex node_at(int i, int j, int k) { return i + (kMeshCells + 1) * (j + (kMeshCells + 1) * k); }

// The star of an interior node of Kuhn's mesh is convex, so a node that moves to a point of its
// boundary flattens the elements there and inverts none.
LinearBody pressed(const Vec3& towards, double part_left) {
  LinearBody body = standing_block(kMeshCells);
  auto x = body.mesh.nodes.col(node_at(2, 2, 2));
  x = (towards + part_left * (x - towards)).eval();
  return body;
}

Vec3 opposite_face_centre() {
  const LinearBody body = standing_block(kMeshCells);
  const NodeIndex centre = node_at(2, 2, 2);
  for (int t = 0; t < body.mesh.num_tets(); ++t) {
    Vec3 sum = Vec3::Zero();
    bool holds = false;
    for (int k = 0; k < 4; ++k) {
      if (body.mesh.tets(k, t) == centre) {
        holds = true;
      } else {
        sum += body.mesh.nodes.col(body.mesh.tets(k, t)) / 3.0;
      }
    }
    if (holds) return sum;
  }
  return Vec3::Zero();
}

void flat_elements(const Options& options) {
  const LinearBody body = standing_block(kMeshCells);
  const Vec3 face = opposite_face_centre(), neighbour = body.mesh.nodes.col(node_at(3, 2, 2));
  for (const double left : thinned(decades(-12, 0), options.grid)) {
    Point point = point_at("mesh", "height (sliver) or edge (needle) over mesh size", left,
                           "one solve: slivers");
    solve_linear(pressed(face, left), point, options);
    point.row = "one solve: needles";
    solve_linear(pressed(neighbour, left), point, options);
  }
}

void size_jumps(const Options& options) {
  for (const double ratio : thinned(decades(0, 10), options.grid)) {
    LinearBody body = standing_block(kMeshCells);
    // Thick and thin layers in turn along x, 60 mm in all.
    std::vector<double> border = {0.0};
    for (int i = 0; i < kMeshCells; ++i)
      border.push_back(border.back() + (i % 2 == 0 ? ratio : 1.0));
    for (NodeIndex n = 0; n < body.mesh.num_nodes(); ++n) {
      body.mesh.nodes(0, n) =
          60.0 * border[static_cast<std::size_t>(n % (kMeshCells + 1))] / border.back();
    }
    Point point =
        point_at("mesh", "thickness of neighbouring layers, ratio", ratio, "one solve: layers");
    solve_linear(body, point, options);
  }
}

}  // namespace

void sweep_mesh(const Options& options) {
  flat_elements(options);
  size_jumps(options);
}

// Displacements far beyond small strain, and bodies that are hardly held.

namespace {

void large_displacements(const Options& options) {
  auto problem = ToyProblem::make(stability_config(), options.fault);
  const std::vector<double> grid = {0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 40.0, 60.0, 100.0, 200.0};
  for (const double largest_mm : thinned(grid, options.grid)) {
    for (const double direction : {1.0, -1.0}) {
      const std::string way = direction > 0.0 ? ", sinking" : ", rising";
      Point point = point_at("load", "largest displacement without contact (mm)", largest_mm,
                             "contact from an empty set" + way);
      solve_and_record(*problem, sagging_load(*problem, direction * largest_mm), point, options);
      const auto data =
          sagging_data(*problem, {.largest_mm = direction * largest_mm, .noise_mm = 0.1});
      if (!data) {
        options.record_refused(data.error(), point);
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
    Point point =
        point_at("load", "stiffness of support over body", support, "one solve: four springs");
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
