// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/forward/forward_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/core/small_matrices.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::forward {
namespace {

// Squared sine-like measure of how well a rigid motion is held. Below it the motion counts as
// free.
constexpr double kHeld = 1e-10;

constexpr double kMaxPoissonRatio = 0.4999;

double poisson_ratio(const fem::Elasticity& e) { return e.lambda / (2.0 * (e.lambda + e.shear)); }
double youngs_modulus(const fem::Elasticity& e) { return 2.0 * e.shear * (1.0 + poisson_ratio(e)); }

Status check_materials(const ForwardProblem& problem) {
  if (static_cast<int>(problem.materials.of_tet.size()) != problem.mesh.num_tets()) {
    return invalid("regions: must give each tetrahedron a material");
  }
  for (const fem::PoroMaterial& material : problem.materials.materials) {
    const fem::Elasticity& e = material.elastic;
    const double nu = poisson_ratio(e);
    // Rounding of nu on its way through lambda.
    if (e.shear > 0.0 && nu > -1.0 && nu <= kMaxPoissonRatio + 1e-9) continue;
    return invalid(fmt::format(
        "materials: shear modulus {} N/mm^2, Poisson's ratio {}: must be > 0 and between -1 and {}",
        e.shear, nu, kMaxPoissonRatio));
  }
  return {};
}

Status check_group(const ForwardProblem& problem, const std::string& key, const std::string& name,
                   bool needs_faces) {
  const auto found = problem.groups.find(name);
  if (found == problem.groups.end()) {
    std::string known;
    for (const auto& [other, group] : problem.groups) known += (known.empty() ? "" : ", ") + other;
    return invalid(fmt::format("{}.on = {}: no such group (there {})", key, name,
                               known.empty() ? "is none" : "are " + known));
  }
  const FaceGroup& group = found->second;
  if (group.vertices.empty() || (needs_faces && group.faces.cols() == 0)) {
    return fail(ErrorCode::kEmptySet,
                fmt::format("{}.on = {}: the group has no {}", key, name,
                            group.vertices.empty() ? "node" : "face of the boundary"));
  }
  if (needs_faces && group.inner.cols() > 0) {
    return invalid(fmt::format(
        "{}.on = {}: {} of the group's faces lie inside the body, where there is no outward side",
        key, name, group.inner.cols()));
  }
  return {};
}

Result<std::vector<ProbeValue>> probe(const ForwardSolution& solution, const Points& displacement,
                                      const VecX& pore_pressure, const Points& points,
                                      double tolerance_mm) {
  const geometry::TetLocator locator(solution.space.mesh);
  std::vector<ProbeValue> values;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const geometry::TetLocation at = locator.locate(points.col(i));
    if (!(at.distance_mm <= tolerance_mm)) {
      return invalid(fmt::format("point {} lies {:.3g} mm outside the mesh", i, at.distance_mm));
    }
    ProbeValue value;
    // The locator's weights belong to its own order of the vertices.
    Eigen::Vector4d l = Eigen::Vector4d::Zero();
    for (int k = 0; k < 4; ++k) {
      for (int a = 0; a < 4; ++a) {
        if (solution.space.mesh.tets(a, at.tet) == at.nodes[k]) l[a] += at.weights[k];
      }
      if (solution.contact_pressure.size() > 0) {
        value.contact_pressure += at.weights[k] * solution.contact_pressure[at.nodes[k]];
      }
      if (pore_pressure.size() > 0) {
        value.pore_pressure += at.weights[k] * pore_pressure[at.nodes[k]];
      }
    }
    value.displacement = fem::displacement_at(solution.space, displacement, at.tet, l);
    values.push_back(value);
  }
  return values;
}

}  // namespace

Status check_support(const std::vector<HeldDirection>& held, const Vec3& centre, double size_mm) {
  Mat6 gram = Mat6::Zero();
  for (const HeldDirection& h : held) {
    Vec6 row;
    row << h.direction, ((h.place - centre) / size_mm).cross(h.direction);
    gram += row * row.transpose();
  }
  const Vec6 eigenvalues = symmetric_eigenvalues(gram);
  const double largest = std::max(eigenvalues[5], 1.0);
  const auto free = (eigenvalues.array() < kHeld * largest).count();
  if (free == 0) return {};
  return fail(ErrorCode::kFloatingBody,
              fmt::format("conditions: the body is not held: {} of its 6 rigid motions {} free",
                          free, free == 1 ? "is" : "are"));
}

Status validate(const ForwardProblem& problem) {
  if (Status ok = geometry::check_mesh(problem.mesh); !ok) {
    return fail(ok.error().code, "mesh.file: " + ok.error().message);
  }
  if (Status ok = check_materials(problem); !ok) return ok;
  for (const Condition& condition : problem.conditions) {
    const bool pore_pressure = std::holds_alternative<PorePressure>(condition.what);
    if (pore_pressure && problem.steps_s.empty()) {
      return invalid("conditions." + condition.name +
                     ".pore_pressure_pa: only problems with a section time have a pore pressure");
    }
    const bool needs_faces = !pore_pressure &&
                             !std::holds_alternative<Displacement>(condition.what) &&
                             !std::holds_alternative<DisplacementField>(condition.what);
    if (Status ok =
            check_group(problem, "conditions." + condition.name, condition.group, needs_faces);
        !ok) {
      return ok;
    }
  }
  if (!problem.steps_s.empty() && !problem.contacts.empty()) {
    return invalid("contact." + problem.contacts.front().name +
                   ": contact is not solved together with a section time");
  }
  if (!problem.steps_s.empty() && problem.element != fem::Element::kP1) {
    return invalid("mesh.element = p2: problems with a section time are solved on p1");
  }
  for (const double step_s : problem.steps_s) {
    if (step_s > 0.0 && std::isfinite(step_s)) continue;
    return invalid(fmt::format("time.steps_s: {} s: must be finite and > 0", step_s));
  }
  for (const Contact& contact : problem.contacts) {
    if (Status ok = check_group(problem, "contact." + contact.name, contact.group, true); !ok) {
      return ok;
    }
  }
  return {};
}

double default_penalty(const ForwardProblem& problem, const FaceGroup& group) {
  std::vector<char> in_group(static_cast<std::size_t>(problem.mesh.num_nodes()), 0);
  for (const NodeIndex v : group.vertices) in_group[static_cast<std::size_t>(v)] = 1;
  double stiffest = 0.0;
  for (int t = 0; t < problem.mesh.num_tets(); ++t) {
    for (int k = 0; k < 4; ++k) {
      if (in_group[static_cast<std::size_t>(problem.mesh.tets(k, t))] == 0) continue;
      stiffest = std::max(stiffest, youngs_modulus(problem.materials.at(t).elastic));
    }
  }
  double edges = 0.0;
  for (Eigen::Index f = 0; f < group.faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      edges += (problem.mesh.nodes.col(group.faces(k, f)) -
                problem.mesh.nodes.col(group.faces((k + 1) % 3, f)))
                   .norm();
    }
  }
  return 100.0 * stiffest / (edges / static_cast<double>(3 * group.faces.cols()));
}

Result<std::vector<ProbeValue>> probe(const ForwardSolution& solution, const Points& points,
                                      double tolerance_mm) {
  if (!solution.history.empty()) {
    return probe(solution, solution.history.size() - 1, points, tolerance_mm);
  }
  return probe(solution, solution.displacement, VecX(), points, tolerance_mm);
}

Result<std::vector<ProbeValue>> probe(const ForwardSolution& solution, std::size_t moment,
                                      const Points& points, double tolerance_mm) {
  const ForwardSolution::Moment& at = solution.history.at(moment);
  return probe(solution, at.displacement, at.pore_pressure, points, tolerance_mm);
}

}  // namespace brainshift::forward
