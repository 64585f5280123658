// SPDX-License-Identifier: GPL-3.0-or-later
// DofMap: from nodal vectors to the unknowns of the linear system.
//
// Every node carries an orthonormal frame R (columns = local axes in RAS). Most frames are the
// identity. At a normal-fixed node the first axis is the boundary normal, and the displacement
// along it is zero *exactly*: the degree of freedom is rotated and eliminated, without any
// penalty. The two tangential ones stay free.
//
//   u_node = R q_node,   q = (constrained: 0, free: unknowns)     expand:   q -> u   (u = T q)
//                                                                 restrict: f -> T^T f
// Order of unknowns: node by node, local axis 0, 1, 2, constrained ones skipped.
#pragma once

#include <array>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift::fem {

class DofMap {
 public:
  // Every node free.
  explicit DofMap(int num_nodes);

  // Fixes the displacement of `node` along unit vector `normal`.
  void fix_normal(NodeIndex node, const Vec3& normal);
  // Fixes the displacement along two orthonormal directions.
  void fix_plane(NodeIndex node, const Vec3& first, const Vec3& second);
  // Fixes one component in RAS; others may follow. Precondition: the node's frame is the
  // identity.
  void fix_component(NodeIndex node, int axis);
  // Fixes all three components.
  void fix_all(NodeIndex node);
  // Numbers the unknowns; call after the last fix_*.
  void finalise();

  int num_nodes() const { return static_cast<int>(frames_.size()); }
  int num_unknowns() const { return num_unknowns_; }
  // Index of the unknown, or -1 where constrained.
  int unknown(NodeIndex node, int local_axis) const { return index_[node][local_axis]; }
  const Mat3& frame(NodeIndex node) const { return frames_[node]; }
  bool has_identity_frame(NodeIndex node) const { return identity_[node] != 0; }

  void expand(const VecX& q, Points& u) const;
  Points expand(const VecX& q) const;
  void restrict_to(const Points& f, VecX& q) const;
  VecX restrict_to(const Points& f) const;
  // The same for several fields at once, one per row: k x 3n (node-major) and k x unknowns.
  void expand_rows(const Eigen::MatrixXd& q, Eigen::MatrixXd& u) const;
  void restrict_rows(const Eigen::MatrixXd& f, Eigen::MatrixXd& q) const;

 private:
  std::vector<Mat3> frames_;
  std::vector<char> identity_;
  std::vector<std::array<int, 3>> index_;  // before finalise(): 0 free, -1 constrained
  int num_unknowns_ = 0;
};

}  // namespace brainshift::fem
