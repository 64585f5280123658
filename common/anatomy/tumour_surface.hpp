// SPDX-License-Identifier: GPL-3.0-or-later
// The undeformed tumour surface of a case: from an ellipsoid, a label volume or a surface file.
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/values/case_inputs.hpp"

namespace brainshift::anatomy {

// Closed and oriented outwards. An ellipsoid or a label volume gives vertices about 1 mm apart
// (about 2,500 for the 10.99 cc tumour of the paper, which had 2,541). Of a label volume only the
// largest connected part is used. kEmptySet: no voxel has the label. kInvalidArgument: a given
// surface that is not closed.
Result<TriangleSurface> make_tumour_surface(const CaseInputs& inputs);

// Ok when every vertex of the tumour lies inside the mesh; otherwise kInvalidArgument with the
// number of vertices outside and the largest distance.
Status check_tumour_inside(const TriangleSurface& tumour, const TetMesh& mesh,
                           const CaseConfig& config);

// The key of the case file that gives the tumour: "tumour.ellipsoid", "tumour.label_volume", ...
const char* tumour_key(const CaseConfig& config);

}  // namespace brainshift::anatomy
