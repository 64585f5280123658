// SPDX-License-Identifier: GPL-3.0-or-later
// Penalty contact against a rigid master surface (paper section 2.3, eq. 9-16).
//
//   penetration         P_i = 0p_i - N_i . u_i                         (eq. 11; > 0 penetrates)
//   energy              1/2 sum_active beta P_i^2                       (eq. 14)
//   modified system     K_p = K + sum_active beta N_i N_i^T             (eq. 16)
//                       b_p = b + sum_active beta 0p_i N_i
//   contact force       beta P_i N_i, pushing the brain inwards when P_i > 0
//
// In the paper's matrices Q_i = -N_i^T. Slaves carry the identity frame, so only their diagonal
// blocks change and the symbolic analysis of K serves K_p.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/dof_map.hpp"
#include "common/fem/elasticity.hpp"

namespace brainshift::contact {

// Three-step contact search (paper section 2.3; Ji et al. 2007): contact point y(s), master
// normal N(s) and initial penetration 0p of every slave node s (eq. 9).
//
// 1. The closest master node.
// 2. Projection onto the master triangles around that node: the closest projection that falls
//    within its triangle.
// 3. If there is none, the closest point on an edge; if there is none, the closest node itself.
//
//   0p = (y - s) . N        negative when open
//   tp = 0p - N . x(s)      after displacement x(s); penetration when > 0 (eq. 11)
// N is the unit normal of the *rigid skull* at y: it points from the skull into the brain.
struct ContactPair {
  NodeIndex slave = -1;
  Vec3 contact_point = Vec3::Zero();    // y(0s), mm
  Vec3 normal = Vec3::Zero();           // N(0s), unit, from skull into brain
  double initial_penetration_mm = 0.0;  // 0p
};

// skull: outward with respect to the brain, so N is minus its triangle normal. One pair per
// slave, in order.
// kEmptySet for an empty skull; kDegenerateMesh for a master triangle without area.
Result<std::vector<ContactPair>> search_contact(const Points& nodes,
                                                const std::vector<NodeIndex>& slaves,
                                                const TriangleSurface& skull);

// One flag per slave, in the order of the pairs.
using ActiveSet = std::vector<char>;

class PenaltyContact {
 public:
  // beta in N/mm, > 0.
  PenaltyContact(std::vector<ContactPair> pairs, double beta);

  const std::vector<ContactPair>& pairs() const { return pairs_; }
  int num_slaves() const { return static_cast<int>(pairs_.size()); }
  double beta() const { return beta_; }

  // P, one per slave, mm. u: 3 x n.
  VecX penetration(const Points& u) const;
  // Slaves with P > 0.
  ActiveSet penetrating(const Points& u) const;

  // Turns K into K_p.
  void add_stiffness(linalg::SymmetricMatrix& lower, const fem::DofMap& dofs,
                     const ActiveSet& active) const;
  // Turns b into b_p (3 x n, N).
  void add_load(Points& b, const ActiveSet& active) const;

 private:
  std::vector<ContactPair> pairs_;
  double beta_;
};

// Number of active slaves.
int count(const ActiveSet& active);

}  // namespace brainshift::contact
