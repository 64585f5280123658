// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/dof_map.hpp"

#include <cassert>
#include <cmath>

namespace brainshift::fem {

DofMap::DofMap(int num_nodes)
    : frames_(num_nodes, Mat3::Identity()), identity_(num_nodes, 1), index_(num_nodes) {
  for (auto& axes : index_) axes = {0, 0, 0};
}

void DofMap::fix_normal(NodeIndex node, const Vec3& normal) {
  assert(std::abs(normal.norm() - 1.0) < 1e-9);
  // The coordinate axis least aligned with the normal gives a well-conditioned tangent.
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vec3 tangent = normal.cross(Vec3::Unit(least)).normalized();
  frames_[node].col(0) = normal;
  frames_[node].col(1) = tangent;
  frames_[node].col(2) = normal.cross(tangent);
  identity_[node] = 0;
  index_[node] = {-1, 0, 0};
}

void DofMap::fix_plane(NodeIndex node, const Vec3& first, const Vec3& second) {
  assert(std::abs(first.dot(second)) < 1e-9);
  frames_[node].col(0) = first;
  frames_[node].col(1) = second;
  frames_[node].col(2) = first.cross(second);
  identity_[node] = 0;
  index_[node] = {-1, -1, 0};
}

void DofMap::fix_component(NodeIndex node, int axis) {
  assert(identity_[node] != 0);
  index_[node][static_cast<std::size_t>(axis)] = -1;
}

void DofMap::fix_all(NodeIndex node) { index_[node] = {-1, -1, -1}; }

void DofMap::finalise() {
  num_unknowns_ = 0;
  for (auto& axes : index_) {
    for (int& axis : axes) {
      if (axis >= 0) axis = num_unknowns_++;
    }
  }
}

void DofMap::expand(const VecX& q, Points& u) const {
  u.resize(3, num_nodes());
  expand_into(q, u);
}

void DofMap::expand_into(const Eigen::Ref<const VecX>& q, Eigen::Ref<Points> u) const {
  assert(q.size() == num_unknowns_ && u.cols() == num_nodes());
  for (int node = 0; node < num_nodes(); ++node) {
    Vec3 local;
    for (int axis = 0; axis < 3; ++axis) {
      const int k = index_[node][axis];
      local[axis] = k >= 0 ? q[k] : 0.0;
    }
    u.col(node) = identity_[node] ? local : Vec3(frames_[node] * local);
  }
}

Points DofMap::expand(const VecX& q) const {
  Points u;
  expand(q, u);
  return u;
}

void DofMap::restrict_to(const Points& f, VecX& q) const {
  q.resize(num_unknowns_);
  restrict_into(f, q);
}

void DofMap::restrict_into(const Eigen::Ref<const Points>& f, Eigen::Ref<VecX> q) const {
  assert(f.cols() == num_nodes() && q.size() == num_unknowns_);
  for (int node = 0; node < num_nodes(); ++node) {
    const Vec3 local =
        identity_[node] ? Vec3(f.col(node)) : Vec3(frames_[node].transpose() * f.col(node));
    for (int axis = 0; axis < 3; ++axis) {
      if (index_[node][axis] >= 0) q[index_[node][axis]] = local[axis];
    }
  }
}

VecX DofMap::restrict_to(const Points& f) const {
  VecX q;
  restrict_to(f, q);
  return q;
}

}  // namespace brainshift::fem
