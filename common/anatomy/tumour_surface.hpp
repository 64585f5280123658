// SPDX-License-Identifier: GPL-3.0-or-later
// The undeformed tumour surface, from whatever the case names: ellipsoid, label volume or surface file.
#pragma once

#include "common/values/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::anatomy {

// Closed and outward. Ellipsoid and label volume give vertices about 1 mm apart (about 2,500 for the
// 10.99 cc tumour of the paper, which had 2,541). Of a label volume only the largest connected part is
// taken. kEmptySet: no voxel with the label. kInvalidArgument: a given surface that is not closed.
Result<TriangleSurface> make_tumour_surface(const CaseInputs& inputs);

// kInvalidArgument with the number of outside vertices and the farthest distance.
Status check_tumour_inside(const TriangleSurface& tumour, const TetMesh& mesh,
                           const CaseConfig& config);

// The part of the case file that gives the tumour: "tumour.ellipsoid", "tumour.label_volume", ...
const char* tumour_key(const CaseConfig& config);

}  // namespace brainshift::anatomy
