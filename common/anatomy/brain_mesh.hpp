// SPDX-License-Identifier: GPL-3.0-or-later
// The tetrahedral mesh of a case: generated from the brain mask, or the ready mesh that the case
// names.
#pragma once

#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"

namespace brainshift::anatomy {

// Generated: mask -> largest component -> Gaussian -> mesh, with mesh.generate's edge lengths.
// tumour_edge_mm applies near the tumour surface. From a refined zone to the rest the edge grows
// by a third of the distance.
// Ready: must pass geometry::check_mesh.
// Either way the largest side of the bounding box must lie between 20 and 400 mm; outside this
// range metres and millimetres were probably mixed up (kInvalidArgument). kEmptySet: mask without
// component. kDegenerateMesh.
Result<TetMesh> make_brain_mesh(const CaseInputs& inputs, const TriangleSurface& tumour,
                                const Progress& progress = {});

}  // namespace brainshift::anatomy
