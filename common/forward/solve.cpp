// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/contact/surface_contact.hpp"
#include "common/core/stopwatch.hpp"
#include "common/fem/biot.hpp"
#include "common/forward/forward_problem.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::forward {
namespace {

// Nodes of a group in the space: its vertices, and with P2 the middles of its faces' edges.
std::set<int> nodes_of(const fem::DisplacementSpace& space, const FaceGroup& group) {
  std::set<int> nodes(group.vertices.begin(), group.vertices.end());
  for (const auto* faces : {&group.faces, &group.inner}) {
    for (Eigen::Index f = 0; f < faces->cols(); ++f) {
      const auto of_face = fem::face_nodes(space, faces->col(f));
      nodes.insert(of_face.begin(), of_face.begin() + space.nodes_per_face());
    }
  }
  nodes.erase(-1);  // an inner triangle that is no face of the mesh
  return nodes;
}

// Mean normals at the nodes of a group's faces, weighted by area; zero elsewhere.
Points group_normals(const fem::DisplacementSpace& space, const FaceGroup& group) {
  Points normals = Points::Zero(3, space.num_nodes());
  for (Eigen::Index f = 0; f < group.faces.cols(); ++f) {
    const Vec3 a = space.mesh.nodes.col(group.faces(0, f));
    const Vec3 area = (space.mesh.nodes.col(group.faces(1, f)) - a)
                          .cross(space.mesh.nodes.col(group.faces(2, f)) - a);
    const auto nodes = fem::face_nodes(space, group.faces.col(f));
    for (int k = 0; k < space.nodes_per_face(); ++k) {
      normals.col(nodes[static_cast<std::size_t>(k)]) += area;
    }
  }
  normals.colwise().normalize();
  return normals;
}

// Adds one condition to the constraints or to the load.
class ConditionAdder {
 public:
  ConditionAdder(const ForwardProblem& problem, Discretised& into)
      : problem_(problem),
        space_(into.space),
        constraints_(into.constraints),
        load_(into.load),
        pore_pressure_(into.pore_pressure) {}

  Status add(const Condition& condition) {
    name_ = "conditions." + condition.name;
    group_ = &problem_.groups.at(condition.group);
    return std::visit([this](const auto& what) { return add(what); }, condition.what);
  }

 private:
  Status add(const Displacement& prescribed) {
    for (const int node : nodes_of(space_, *group_)) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto& value = prescribed.components[static_cast<std::size_t>(axis)];
        if (!value) continue;
        if (Status ok = constraints_.add(node, Vec3::Unit(axis), *value, name_); !ok) return ok;
      }
    }
    return {};
  }
  Status add(const DisplacementField& prescribed) {
    for (const int node : nodes_of(space_, *group_)) {
      if (Status ok = constraints_.add_all(node, prescribed.u(space_.nodes.col(node)), name_); !ok)
        return ok;
    }
    return {};
  }
  Status add(const NormalDisplacement& prescribed) {
    const Points normals = group_normals(space_, *group_);
    for (const int node : nodes_of(space_, *group_)) {
      const Vec3 normal = normals.col(node);
      if (normal.isZero()) continue;  // a vertex without a face
      if (Status ok = constraints_.add(node, normal, prescribed.value, name_); !ok) return ok;
    }
    return {};
  }
  Status add(const Traction& traction) {
    load_ += fem::traction_load(space_, group_->faces, traction.t);
    return {};
  }
  Status add(const Pressure& pressure) {
    load_ += fem::pressure_load(space_, group_->faces, pressure.value);
    return {};
  }
  Status add(const PorePressure& pressure) {
    for (const NodeIndex node : group_->vertices) {
      const auto [held, fresh] = pore_pressure_.emplace(node, pressure.value);
      if (fresh || held->second == pressure.value) continue;
      return invalid(fmt::format("{}: node {} has another pore pressure already", name_, node));
    }
    return {};
  }

  const ForwardProblem& problem_;
  const fem::DisplacementSpace& space_;
  fem::DisplacementConstraints& constraints_;
  Points& load_;
  std::map<NodeIndex, double>& pore_pressure_;
  std::string name_;
  const FaceGroup* group_ = nullptr;
};

Points body_load(const ForwardProblem& problem, const fem::DisplacementSpace& space) {
  Points load = Points::Zero(3, space.num_nodes());
  if (problem.body_force.cols() > 0) load += fem::body_load(space, problem.body_force);
  if (problem.body_field) load += fem::body_load(space, problem.body_field);
  return load;
}

Result<contact::SurfaceContact> build_contact(const ForwardProblem& problem,
                                              const fem::DisplacementSpace& space) {
  contact::SurfaceContact contact(space);
  for (const Contact& c : problem.contacts) {
    const FaceGroup& group = problem.groups.at(c.group);
    const double kappa = c.penalty.value_or(default_penalty(problem, group));
    if (Status ok = contact.add(group.faces, c.obstacle, kappa); !ok) {
      return fail(ok.error().code, "contact." + c.name + ": " + ok.error().message);
    }
  }
  return contact;
}

// Prescribed directions, and the contact points that touch in the undeformed state, must hold the
// body.
Status check_held(const fem::DisplacementSpace& space,
                  const fem::DisplacementConstraints& constraints,
                  const contact::SurfaceContact& contact, const Points& lift, double touching_mm) {
  const Vec3 low = space.mesh.nodes.rowwise().minCoeff();
  const Vec3 high = space.mesh.nodes.rowwise().maxCoeff();
  std::vector<HeldDirection> held;
  for (int node = 0; node < space.num_nodes(); ++node) {
    for (const Vec3& axis : constraints.directions(node))
      held.push_back({space.nodes.col(node), axis});
  }
  const VecX penetration = contact.penetration(lift);
  for (int i = 0; i < contact.num_points(); ++i) {
    if (!(penetration[i] + touching_mm > 0.0)) continue;
    const auto& point = contact.points()[static_cast<std::size_t>(i)];
    Vec3 place = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      place += point.vertex_weight[k] * space.mesh.nodes.col(point.nodes[k]);
    held.push_back({place, point.normal});
  }
  Status ok = check_support(held, 0.5 * (low + high), 0.5 * (high - low).norm());
  if (ok || contact.num_points() == 0) return ok;
  return fail(ok.error().code,
              ok.error().message + ", and no obstacle that it touches at the start holds them");
}

void add_contact_results(const ForwardProblem& problem, const contact::SurfaceContact& contact,
                         const contact::ActiveSet& active, ForwardSolution& solution) {
  if (contact.num_points() == 0) return;
  for (const Contact& c : problem.contacts) solution.contacts.push_back({c.name});
  const VecX penetration = contact.penetration(solution.displacement);
  for (int i = 0; i < contact.num_points(); ++i) {
    const auto& point = contact.points()[static_cast<std::size_t>(i)];
    ContactResult& result = solution.contacts[static_cast<std::size_t>(point.obstacle)];
    ++result.points;
    if (!active[static_cast<std::size_t>(i)]) continue;
    ++result.active;
    result.area_mm2 += point.area;
    result.force += point.stiffness * penetration[i] * point.normal;
    result.max_penetration_mm = std::max(result.max_penetration_mm, penetration[i]);
    result.max_pressure =
        std::max(result.max_pressure, point.stiffness / point.area * penetration[i]);
  }
  solution.contact_pressure = contact.vertex_pressure(solution.displacement);
}

// Adds warnings that a reader of the solution should see: locking, inverted elements, a large
// residual, contact that never touches.
void add_warnings(const ForwardProblem& problem, ForwardSolution& solution) {
  // A backward error above this is worth a warning.
  constexpr double kLargeResidual = 1e-8;
  double largest = 0.0;
  for (const int m :
       std::set<int>(problem.materials.of_tet.begin(), problem.materials.of_tet.end())) {
    const fem::Elasticity& e = problem.materials.materials[static_cast<std::size_t>(m)].elastic;
    largest = std::max(largest, e.lambda / (2.0 * (e.lambda + e.shear)));
  }
  if (problem.element == fem::Element::kP1 && largest > fem::kLockingPoissonRatio) {
    solution.warnings.push_back(
        fmt::format("element p1 locks: Poisson's ratio {:.4g} is above {}; use p2", largest,
                    fem::kLockingPoissonRatio));
  }
  if (!(solution.min_jacobian > 0.0)) {
    solution.warnings.push_back(fmt::format(
        "an element is inverted: smallest det(I + grad u) is {:.3g}", solution.min_jacobian));
  }
  if (!(solution.relative_residual < kLargeResidual)) {
    solution.warnings.push_back(
        fmt::format("relative residual {:.3g} is large", solution.relative_residual));
  }
  for (const ContactResult& c : solution.contacts) {
    if (c.active == 0) solution.warnings.push_back("contact." + c.name + ": nothing touches");
  }
}

// kFloatingBody: the prescribed displacements leave a rigid motion free.
Status check_supports(const Discretised& discretised) {
  const fem::DisplacementSpace& space = discretised.space;
  const Points at_rest = Points::Zero(3, space.num_nodes());
  return check_held(space, discretised.constraints, contact::SurfaceContact(space), at_rest, 0.0);
}

void add_stabilised(int step, int tets, double dt_s, double bound_s, ForwardSolution& solution) {
  if (tets == 0) return;
  solution.warnings.push_back(fmt::format(
      "step {} of {:.3g} s: pressure stabilised in {} tetrahedra (steps above {:.3g} s need none)",
      step, dt_s, tets, bound_s));
}

// Biot consolidation from rest by backward Euler with the step lengths problem.steps_s
// (fem/biot.hpp). Element P1, no contacts. A material that neither lets fluid through nor stores
// it is allowed: it stays undrained.
// relative_residual and rcond are the worst of all steps. Stress is the effective one: the total
// stress plus alpha p I.
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

}  // namespace

Result<Discretised> discretise(const ForwardProblem& problem) {
  if (Status ok = validate(problem); !ok) return tl::unexpected(ok.error());
  fem::DisplacementSpace space = fem::make_space(problem.mesh, problem.element);
  const int nodes = space.num_nodes();
  Points load = body_load(problem, space);
  Discretised result{std::move(space), fem::DisplacementConstraints(nodes), std::move(load), {}};
  ConditionAdder adder(problem, result);
  for (const Condition& condition : problem.conditions) {
    if (Status ok = adder.add(condition); !ok) return tl::unexpected(ok.error());
  }
  return result;
}

Result<ForwardSolution> solve(const ForwardProblem& problem, const Progress& progress) {
  const Stopwatch watch;
  report(progress, "assemble", 0.0);
  auto discretised = discretise(problem);
  if (!discretised) return tl::unexpected(discretised.error());
  if (!problem.steps_s.empty()) return consolidate(problem, std::move(*discretised), progress);
  ForwardSolution solution;
  solution.space = std::move(discretised->space);
  const fem::DisplacementSpace& space = solution.space;
  const fem::DisplacementConstraints& constraints = discretised->constraints;
  const Points& load = discretised->load;

  const fem::ConstrainedDofs constrained = constraints.build();
  auto contact = build_contact(problem, space);
  if (!contact) return tl::unexpected(contact.error());
  contact::UnilateralOptions options;
  options.touching_mm =
      1e-9 * (space.mesh.nodes.rowwise().maxCoeff() - space.mesh.nodes.rowwise().minCoeff()).norm();
  if (Status ok = check_held(space, constraints, *contact, constrained.lift, options.touching_mm);
      !ok) {
    return tl::unexpected(ok.error());
  }

  const linalg::SymmetricMatrix stiffness =
      fem::assemble_stiffness(space, problem.materials, constrained.dofs);
  const Points lifted = load - fem::internal_force(space, problem.materials, constrained.lift);
  solution.unknowns = constrained.dofs.num_unknowns();
  solution.assemble_s = watch.seconds();
  report(progress, "assemble", 1.0);

  const Stopwatch solve_watch;
  auto found =
      contact::solve_unilateral(stiffness, constrained, *contact, lifted, options, progress);
  if (!found) return tl::unexpected(found.error());
  solution.solve_s = solve_watch.seconds();
  solution.displacement = std::move(found->displacement);
  solution.iterations = found->iterations;
  solution.relative_residual = found->relative_residual;
  solution.rcond = found->rcond;

  solution.element_stress = fem::element_stress(space, problem.materials, solution.displacement);
  solution.nodal_stress = fem::nodal_stress(space, problem.materials, solution.displacement);
  solution.min_jacobian = fem::min_jacobian(space, solution.displacement);
  add_contact_results(problem, *contact, found->active, solution);
  // Equilibrium of the whole body: the supports balance the sum of loads and obstacle forces.
  solution.reaction = -load.rowwise().sum();
  for (const ContactResult& c : solution.contacts) solution.reaction -= c.force;
  add_warnings(problem, solution);
  return solution;
}

}  // namespace brainshift::forward
