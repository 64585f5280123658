// SPDX-License-Identifier: GPL-3.0-or-later
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
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::contact {

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

}  // namespace brainshift::contact
