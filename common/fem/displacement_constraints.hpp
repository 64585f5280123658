// SPDX-License-Identifier: GPL-3.0-or-later
// DisplacementConstraints: prescribed displacements n . u = value, gathered node by node, along
// any number of directions.
//
// The directions of a node are made orthonormal one after the other. They become the first axes
// of its frame and are eliminated exactly (dof_map.hpp). Values enter as a lift: u = T q + lift,
// so that T^T K T q = T^T (f - K lift). A node whose directions are coordinate axes keeps the
// identity frame.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/fem/dof_map.hpp"

namespace brainshift::fem {

struct ConstrainedDofs {
  DofMap dofs;
  Points lift;  // 3 x n, mm; zero along free directions
};

class DisplacementConstraints {
 public:
  explicit DisplacementConstraints(int num_nodes);

  // n . u = value at a node; n of length one. Messages name `source`. A direction that the
  // earlier directions of the node span must agree with them: otherwise kInvalidArgument, naming
  // both sources.
  Status add(NodeIndex node, const Vec3& direction, double value, const std::string& source);
  Status add_all(NodeIndex node, const Vec3& value, const std::string& source);

  // Orthonormal constrained directions of a node.
  std::vector<Vec3> directions(NodeIndex node) const;
  ConstrainedDofs build() const;

 private:
  struct Direction {
    Vec3 axis;
    double value;
    int source;
  };
  std::vector<std::vector<Direction>> of_node_;
  std::vector<std::string> sources_;
};

}  // namespace brainshift::fem
