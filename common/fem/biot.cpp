// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/biot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace brainshift::fem {
namespace {

tl::unexpected<Error> invalid_value(const std::string& what, double value,
                                    const std::string& constraint) {
  return invalid(fmt::format("{} = {:g}: {}", what, value, constraint));
}

Status check_material(const PoroMaterial& material, std::size_t index) {
  const std::string name = "material " + std::to_string(index) + ": ";
  const Elasticity& elastic = material.elastic;
  // Written so that NaN fails.
  if (!(elastic.shear > 0.0 && std::isfinite(elastic.shear))) {
    return invalid_value(name + "shear modulus", elastic.shear, "must be positive and finite");
  }
  const double bulk = elastic.lambda + 2.0 / 3.0 * elastic.shear;
  if (!(bulk > 0.0 && std::isfinite(bulk))) {
    return invalid_value(name + "drained bulk modulus", bulk, "must be positive and finite");
  }
  if (!(material.biot_coefficient >= 0.0 && material.biot_coefficient <= 1.0)) {
    return invalid_value(name + "Biot coefficient", material.biot_coefficient, "must be 0 to 1");
  }
  if (!(material.storage >= 0.0 && std::isfinite(material.storage))) {
    return invalid_value(name + "storage", material.storage, "must be zero or positive");
  }
  if (!(material.permeability >= 0.0 && std::isfinite(material.permeability))) {
    return invalid_value(name + "permeability", material.permeability, "must be zero or positive");
  }
  return {};
}

Status check_domain(const TetMesh& mesh, const MaterialMap& materials, const DofMap& dofs,
                    const std::vector<NodeIndex>& drained) {
  for (std::size_t m = 0; m < materials.materials.size(); ++m) {
    if (auto ok = check_material(materials.materials[m], m); !ok) return ok;
  }
  if (materials.of_tet.size() != static_cast<std::size_t>(mesh.num_tets())) {
    return invalid_value("materials for tetrahedra", static_cast<double>(materials.of_tet.size()),
                         "the mesh has " + std::to_string(mesh.num_tets()));
  }
  const int count = static_cast<int>(materials.materials.size());
  for (const int material : materials.of_tet) {
    if (material < 0 || material >= count) {
      return invalid_value("material index", material, "there are " + std::to_string(count));
    }
  }
  if (dofs.num_nodes() != mesh.num_nodes()) {
    return invalid_value("nodes with displacements", dofs.num_nodes(),
                         "the mesh has " + std::to_string(mesh.num_nodes()));
  }
  for (const NodeIndex node : drained) {
    if (node < 0 || node >= mesh.num_nodes()) {
      return invalid_value("drained node", node,
                           "the mesh has " + std::to_string(mesh.num_nodes()));
    }
  }
  return {};
}

Status check_array(const char* what, Eigen::Index columns, int nodes, bool may_be_empty,
                   bool finite) {
  if (columns != nodes && !(may_be_empty && columns == 0)) {
    return invalid_value(what, static_cast<double>(columns),
                         "nodes given, the mesh has " + std::to_string(nodes));
  }
  if (!finite) {
    return fail(ErrorCode::kNotFinite, std::string(what) + " holds a value that is not finite");
  }
  return {};
}

// C e = G_tet^T u: volume increase of the element times alpha / 4, the same for its four nodes.
double element_inflow(const BiotElement& element, const TetMesh& mesh, int tet, const Points& u) {
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) sum += element.coupling.col(i).dot(u.col(mesh.tets(i, tet)));
  return sum;
}

Eigen::Vector4d at_nodes(const TetMesh& mesh, int tet, const VecX& p) {
  return {p[mesh.tets(0, tet)], p[mesh.tets(1, tet)], p[mesh.tets(2, tet)], p[mesh.tets(3, tet)]};
}

}  // namespace

BiotStepper::BiotStepper(const TetMesh& mesh, const MaterialMap& materials, const DofMap& dofs,
                         const std::vector<NodeIndex>& drained, const BiotOptions& options)
    : mesh_(mesh),
      materials_(materials),
      dofs_(dofs),
      pressure_(mesh.num_nodes(), drained),
      options_(options) {
  diagnostics_.smallest_bound_s = std::numeric_limits<double>::infinity();
  for (int t = 0; t < mesh_.num_tets(); ++t) {
    const double bound = vermeer_verruijt_step_s(materials_.at(t), tet_geometry(mesh_, t).volume);
    diagnostics_.smallest_bound_s = std::min(diagnostics_.smallest_bound_s, bound);
    diagnostics_.largest_bound_s = std::max(diagnostics_.largest_bound_s, bound);
  }
}

Result<BiotStepper> BiotStepper::build(const TetMesh& mesh, const MaterialMap& materials,
                                       const DofMap& dofs, const std::vector<NodeIndex>& drained,
                                       const BiotOptions& options) {
  if (auto ok = check_domain(mesh, materials, dofs, drained); !ok) {
    return tl::unexpected(ok.error());
  }
  return BiotStepper(mesh, materials, dofs, drained, options);
}

Result<BiotStepper::Kept*> BiotStepper::factor_for(double dt_s) {
  const auto found = factors_.find(dt_s);
  diagnostics_.factorised = found == factors_.end();
  if (found != factors_.end()) {
    found->second.last_used = steps_;
    return &found->second;
  }
  const BiotMatrix matrix =
      assemble_biot(mesh_, materials_, dofs_, pressure_, dt_s, options_.stabilise);
  auto factor = linalg::SymmetricIndefinite::factorise(matrix.lower, matrix.pressure_unknowns);
  if (!factor) return tl::unexpected(factor.error());
  if (factors_.size() >= static_cast<std::size_t>(std::max(1, options_.kept_factors))) {
    factors_.erase(std::min_element(factors_.begin(), factors_.end(), [](auto& a, auto& b) {
      return a.second.last_used < b.second.last_used;
    }));
  }
  const auto kept =
      factors_.emplace(dt_s, Kept{std::move(*factor), matrix.stabilised_tets, steps_});
  return &kept.first->second;
}

Status BiotStepper::check(const BiotState& state, const BiotLoad& load, double dt_s) const {
  if (!(dt_s > 0.0 && std::isfinite(dt_s))) {
    return invalid_value("time step in seconds", dt_s, "must be positive and finite");
  }
  const int n = mesh_.num_nodes();
  const auto checks = {
      check_array("displacement of the state", state.displacement.cols(), n, false,
                  state.displacement.allFinite()),
      check_array("pressure of the state", state.pressure.size(), n, false,
                  state.pressure.allFinite()),
      check_array("force", load.force.cols(), n, true, load.force.allFinite()),
      check_array("source", load.source.size(), n, true, load.source.allFinite()),
      check_array("prescribed displacement", load.displacement.cols(), n, true,
                  load.displacement.allFinite()),
      check_array("prescribed pressure", load.pressure.size(), n, true, load.pressure.allFinite())};
  for (const Status& status : checks) {
    if (!status) return status;
  }
  return {};
}

// The state before the step, with the values that the load prescribes at its end.
BiotState BiotStepper::with_prescribed(const BiotState& state, const BiotLoad& load) const {
  BiotState guess = state;
  for (int node = 0; node < mesh_.num_nodes(); ++node) {
    if (pressure_.unknown[static_cast<std::size_t>(node)] < 0) {
      guess.pressure[node] = load.pressure.size() > 0 ? load.pressure[node] : 0.0;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (dofs_.unknown(node, axis) >= 0) continue;
      const Vec3 direction = dofs_.frame(node).col(axis);
      const double value =
          load.displacement.cols() > 0 ? direction.dot(load.displacement.col(node)) : 0.0;
      guess.displacement.col(node) +=
          (value - direction.dot(guess.displacement.col(node))) * direction;
    }
  }
  return guess;
}

// Right-hand side for the correction of `guess`: the residuals of the two equations, at the
// unknowns.
VecX BiotStepper::residual(const BiotState& before, const BiotState& guess, const BiotLoad& load,
                           double dt_s) const {
  Points force = -internal_force(guess);
  if (load.force.cols() > 0) force += load.force;
  VecX flow = load.source.size() > 0 ? VecX(-dt_s * load.source) : VecX::Zero(mesh_.num_nodes());
  const Points moved = guess.displacement - before.displacement;
  const VecX risen = guess.pressure - before.pressure;
  for (int t = 0; t < mesh_.num_tets(); ++t) {
    const BiotElement element =
        biot_element(tet_geometry(mesh_, t), materials_.at(t), dt_s, options_.stabilise);
    const double inflow = element_inflow(element, mesh_, t, moved);
    const Eigen::Vector4d balance =
        dt_s * element.diffusion * at_nodes(mesh_, t, guess.pressure) +
        (element.storage + element.stabilisation) * at_nodes(mesh_, t, risen);
    for (int i = 0; i < 4; ++i) flow[mesh_.tets(i, t)] += inflow + balance[i];
  }
  VecX rhs(dofs_.num_unknowns() + pressure_.num_unknowns);
  rhs.head(dofs_.num_unknowns()) = dofs_.restrict_to(force);
  for (int node = 0; node < mesh_.num_nodes(); ++node) {
    const int unknown = pressure_.unknown[static_cast<std::size_t>(node)];
    if (unknown >= 0) rhs[dofs_.num_unknowns() + unknown] = flow[node];
  }
  return rhs;
}

Result<BiotState> BiotStepper::step(const BiotState& state, const BiotLoad& load, double dt_s) {
  if (auto ok = check(state, load, dt_s); !ok) return tl::unexpected(ok.error());
  ++steps_;
  const auto kept = factor_for(dt_s);
  if (!kept) return tl::unexpected(kept.error());
  const linalg::SymmetricIndefinite& factor = (*kept)->factor;

  BiotState next = with_prescribed(state, load);
  VecX correction;
  if (auto ok = factor.solve(residual(state, next, load, dt_s), correction); !ok) {
    return tl::unexpected(ok.error());
  }
  next.displacement += dofs_.expand(correction.head(dofs_.num_unknowns()));
  for (int node = 0; node < mesh_.num_nodes(); ++node) {
    const int unknown = pressure_.unknown[static_cast<std::size_t>(node)];
    if (unknown >= 0) next.pressure[node] += correction[dofs_.num_unknowns() + unknown];
  }
  diagnostics_.dt_s = dt_s;
  diagnostics_.stabilised_tets = (*kept)->stabilised_tets;
  diagnostics_.rcond = factor.rcond();
  diagnostics_.backward_error = factor.last_check().backward_error;
  diagnostics_.refinements = factor.last_check().refinements;
  return next;
}

Points BiotStepper::internal_force(const BiotState& state) const {
  Points force = Points::Zero(3, mesh_.num_nodes());
  for (int t = 0; t < mesh_.num_tets(); ++t) {
    const TetGeometry geometry = tet_geometry(mesh_, t);
    const PoroMaterial& material = materials_.at(t);
    Mat3 gradient = Mat3::Zero();
    double mean_pressure = 0.0;
    for (int i = 0; i < 4; ++i) {
      const NodeIndex node = mesh_.tets(i, t);
      gradient += state.displacement.col(node) * geometry.gradients.col(i).transpose();
      mean_pressure += 0.25 * state.pressure[node];
    }
    Mat3 stress = material.elastic.shear * (gradient + gradient.transpose());
    stress.diagonal().array() +=
        material.elastic.lambda * gradient.trace() - material.biot_coefficient * mean_pressure;
    for (int i = 0; i < 4; ++i) {
      force.col(mesh_.tets(i, t)) += geometry.volume * stress * geometry.gradients.col(i);
    }
  }
  return force;
}

}  // namespace brainshift::fem
