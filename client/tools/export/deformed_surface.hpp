// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of a model as the displacement moves them, with what moved them on their vertices.
//
//   vertices         x + u(x), RAS, mm
//   displacement_mm  u(x), three components; moves undeformed to deformed
//   sd_mm            standard deviation of u(x); left out where the update has none
#pragma once

#include <vector>

#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

struct DeformedSurface {
  TriangleSurface surface;
  std::vector<io::NodeField> vertex_fields;
};

// u: 3 x nodes of the mesh; sd_mm: one per node, or empty.
// The tumour's vertices lie anywhere in the mesh: u is interpolated there (outside of the mesh: at
// its closest point).
DeformedSurface deformed_tumour(const BrainModel& model, const Points& u, const VecX& sd_mm);
// The whole surface of the brain's mesh, brainstem included.
DeformedSurface deformed_cortex(const BrainModel& model, const Points& u, const VecX& sd_mm);

}  // namespace brainshift::client
