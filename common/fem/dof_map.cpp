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
  assert(q.size() == num_unknowns_);
  u.resize(3, num_nodes());
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
  assert(f.cols() == num_nodes());
  q.resize(num_unknowns_);
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

void DofMap::expand_rows(const Eigen::MatrixXd& q, Eigen::MatrixXd& u) const {
  assert(q.cols() == num_unknowns_);
  u.resize(q.rows(), 3 * static_cast<Eigen::Index>(num_nodes()));
  Eigen::Matrix<double, Eigen::Dynamic, 3> turned;
  for (int node = 0; node < num_nodes(); ++node) {
    auto own = u.middleCols<3>(3L * node);
    for (int axis = 0; axis < 3; ++axis) {
      const int k = index_[node][axis];
      if (k >= 0) {
        own.col(axis) = q.col(k);
      } else {
        own.col(axis).setZero();
      }
    }
    if (identity_[node]) continue;
    turned = own * frames_[node].transpose();
    own = turned;
  }
}

void DofMap::restrict_rows(const Eigen::MatrixXd& f, Eigen::MatrixXd& q) const {
  assert(f.cols() == 3 * static_cast<Eigen::Index>(num_nodes()));
  q.resize(f.rows(), num_unknowns_);
  Eigen::Matrix<double, Eigen::Dynamic, 3> local;
  for (int node = 0; node < num_nodes(); ++node) {
    const auto own = f.middleCols<3>(3L * node);
    if (!identity_[node]) local = own * frames_[node];
    for (int axis = 0; axis < 3; ++axis) {
      const int k = index_[node][axis];
      if (k < 0) continue;
      if (identity_[node]) {
        q.col(k) = own.col(axis);
      } else {
        q.col(k) = local.col(axis);
      }
    }
  }
}

}  // namespace brainshift::fem
