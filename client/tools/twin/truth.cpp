// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/truth.hpp"

#include <Eigen/Geometry>
#include <string>
#include <utility>

#include "client/tools/twin/adverse.hpp"
#include "client/tools/twin/sheets.hpp"
#include "client/tools/twin/stiffness.hpp"

namespace brainshift::client {
namespace {

enum class Hold : char { kInner, kFree, kSlave, kFixed };

// How a node of the space is held, and its outward normal.
struct BoundaryNodes {
  std::vector<Hold> hold;
  Points normals;  // 3 x nodes; zero inside
};

Hold edge_hold(Hold a, Hold b) {
  if (a == Hold::kFixed || b == Hold::kFixed) return Hold::kFixed;
  return a == Hold::kFree && b == Hold::kFree ? Hold::kFree : Hold::kSlave;
}

BoundaryNodes boundary_nodes(const BrainModel& model, const fem::DisplacementSpace& space) {
  BoundaryNodes boundary{
      std::vector<Hold>(static_cast<std::size_t>(space.num_nodes()), Hold::kInner),
      Points::Zero(3, space.num_nodes())};
  const auto set = [&](const std::vector<NodeIndex>& nodes, Hold hold) {
    for (const NodeIndex node : nodes) boundary.hold[static_cast<std::size_t>(node)] = hold;
  };
  set(model.craniotomy, Hold::kFree);
  set(model.brainstem, Hold::kFree);
  set(model.slaves, Hold::kSlave);
  set(model.fixed, Hold::kFixed);
  for (Eigen::Index f = 0; f < model.boundary_triangles.cols(); ++f) {
    const Eigen::Vector3i face = model.boundary_triangles.col(f);
    const auto nodes = fem::face_nodes(space, face);
    const Vec3 a = space.nodes.col(face[0]);
    const Vec3 area = Vec3(space.nodes.col(face[1]) - a).cross(Vec3(space.nodes.col(face[2]) - a));
    for (int k = 0; k < space.nodes_per_face(); ++k) {
      const auto node = static_cast<std::size_t>(nodes[static_cast<std::size_t>(k)]);
      boundary.normals.col(static_cast<Eigen::Index>(node)) += area;
      if (k < 3) continue;
      boundary.hold[node] = edge_hold(boundary.hold[static_cast<std::size_t>(face[k - 3])],
                                      boundary.hold[static_cast<std::size_t>(face[(k - 2) % 3])]);
    }
  }
  for (Eigen::Index i = 0; i < boundary.normals.cols(); ++i) {
    if (!boundary.normals.col(i).isZero(0.0)) boundary.normals.col(i).normalize();
  }
  return boundary;
}

void set_gaps(std::uint64_t seed, const Points& nodes, std::vector<contact::ContactPair>& pairs) {
  const GaussianField field(kGapLength_mm, seed);
  for (contact::ContactPair& pair : pairs) {
    const double part = normal_cdf(field.at(nodes.col(pair.slave)));
    pair.initial_penetration_mm = -(kMinGap_mm + (kMaxGap_mm - kMinGap_mm) * part);
  }
}

// Sheets of falx and tentorium; of quadratic elements the middles of edges carry the load.
void add_septa(const BrainModel& model, const fem::DisplacementSpace& space,
               const std::vector<Hold>& hold, std::vector<contact::ContactPair>& pairs) {
  for (const SheetNode& side : sheet_nodes(model.septa, space)) {
    const bool carries_load =
        space.element == fem::Element::kP1 || side.node >= space.num_vertices();
    if (!carries_load || hold[static_cast<std::size_t>(side.node)] == Hold::kFixed) continue;
    const Vec3 normal = -side.normal;
    pairs.push_back({side.node, space.nodes.col(side.node) - model.septa.gap_mm * normal, normal,
                     -model.septa.gap_mm});
  }
}

std::size_t boundary_count(const BrainModel& model) {
  return model.craniotomy.size() + model.brainstem.size() + model.slaves.size() +
         model.fixed.size();
}

}  // namespace

Result<Truth> TruthSolver::solve(const Points& load) {
  Truth truth;
  Points u;
  if (Status ok = system_.solve_with_gaps(load, u); !ok) return tl::unexpected(ok.error());
  for (truth.iterations = 1; truth.iterations <= kMaxIterations; ++truth.iterations) {
    const auto changed = system_.follow_contact(load, u);
    if (!changed) return tl::unexpected(changed.error());
    if (*changed) continue;
    truth.active = contact::count(system_.active());
    const contact::PenaltyContact& contact = system_.forward().contact();
    if (contact.num_slaves() > 0) truth.max_penetration_mm = contact.penetration(u).maxCoeff();
    truth.displacement = std::move(u);
    return truth;
  }
  return fail(ErrorCode::kNotConverged, "the contact search of the truth did not settle after " +
                                            std::to_string(kMaxIterations) + " solves");
}

GivenTruth::GivenTruth(Points displacement, const contact::PenaltyContact& contact) {
  truth_.active = contact::count(contact.penetrating(displacement));
  if (contact.num_slaves() > 0) {
    truth_.max_penetration_mm = contact.penetration(displacement).maxCoeff();
  }
  truth_.displacement = std::move(displacement);
}

Result<Truth> GivenTruth::solve(const Points& /*load*/) { return truth_; }

// truth_forward() of truth_brain.hpp.

Result<contact::ForwardModel> truth_forward(const TruthBrain& brain, const Progress& progress) {
  if (!brain.elsewhere && !brain.gap_seed) {
    return contact::ForwardModel::build(brain.model, brain.config, Boundary::kContact, progress);
  }
  const BrainModel& model = brain.elsewhere ? brain.elsewhere->model : brain.model;
  const fem::DisplacementSpace own =
      brain.elsewhere ? fem::DisplacementSpace{} : fem::make_space(model.mesh, fem::Element::kP1);
  const fem::DisplacementSpace& space = brain.elsewhere ? brain.elsewhere->space : own;
  const auto materials = contact::tissue_map(model, brain.config.material);
  if (!materials) return tl::unexpected(materials.error());

  const BoundaryNodes boundary = boundary_nodes(model, space);
  fem::DofMap dofs(space.num_nodes());
  std::vector<NodeIndex> slaves;
  for (int node = 0; node < space.num_nodes(); ++node) {
    const Hold hold = boundary.hold[static_cast<std::size_t>(node)];
    if (hold == Hold::kFixed) dofs.fix_normal(node, boundary.normals.col(node));
    const bool carries_load = space.element == fem::Element::kP1 || node >= space.num_vertices();
    if (hold == Hold::kSlave && carries_load) slaves.push_back(node);
  }
  dofs.finalise();
  auto pairs = contact::search_contact(space.nodes, slaves, model.skull);
  if (!pairs) return tl::unexpected(pairs.error());
  if (brain.gap_seed) set_gaps(*brain.gap_seed, space.nodes, *pairs);
  add_septa(model, space, boundary.hold, *pairs);
  double beta = brain.config.contact.penalty_n_per_mm;
  if (brain.elsewhere) {  // three edges per triangle, each in two of them
    beta *= static_cast<double>(boundary_count(brain.model)) /
            (1.5 * static_cast<double>(model.boundary_triangles.cols()));
  }
  return contact::ForwardModel::assemble(space, *materials, std::move(dofs),
                                         contact::PenaltyContact(std::move(*pairs), beta),
                                         progress);
}

}  // namespace brainshift::client
