// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/penalty.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace brainshift::contact {

PenaltyContact::PenaltyContact(std::vector<ContactPair> pairs, double beta)
    : pairs_(std::move(pairs)), beta_(beta) {
  assert(beta_ > 0.0);
}

VecX PenaltyContact::penetration(const Points& u) const {
  VecX p(num_slaves());
  for (int i = 0; i < num_slaves(); ++i) {
    p[i] = pairs_[i].initial_penetration_mm - pairs_[i].normal.dot(u.col(pairs_[i].slave));
  }
  return p;
}

ActiveSet PenaltyContact::penetrating(const Points& u) const {
  const VecX p = penetration(u);
  ActiveSet active(pairs_.size());
  for (int i = 0; i < num_slaves(); ++i) active[i] = p[i] > 0.0;
  return active;
}

void PenaltyContact::add_stiffness(linalg::SymmetricMatrix& lower, const fem::DofMap& dofs,
                                   const ActiveSet& active) const {
  assert(active.size() == pairs_.size());
  for (int i = 0; i < num_slaves(); ++i) {
    if (!active[i]) continue;
    const Vec3& normal = pairs_[i].normal;
    fem::add_to_node_block(lower, dofs, pairs_[i].slave, beta_ * normal * normal.transpose());
  }
}

void PenaltyContact::add_load(Points& b, const ActiveSet& active) const {
  assert(active.size() == pairs_.size());
  for (int i = 0; i < num_slaves(); ++i) {
    if (!active[i]) continue;
    b.col(pairs_[i].slave) += beta_ * pairs_[i].initial_penetration_mm * pairs_[i].normal;
  }
}

int count(const ActiveSet& active) {
  return static_cast<int>(
      std::count_if(active.begin(), active.end(), [](char a) { return a != 0; }));
}

}  // namespace brainshift::contact
