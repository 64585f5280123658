// SPDX-License-Identifier: GPL-3.0-or-later
// The undeformed tumour surface of a case: from an ellipsoid, a label volume or a surface file.
#pragma once

#include <string>

#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::anatomy {

// Closed and oriented outwards. An ellipsoid or a label volume gives vertices about 1 mm apart
// (about 2,500 for the 10.99 cc tumour of the paper, which had 2,541). Of a label volume only the
// largest connected part is used. kEmptySet: no voxel has the label. kInvalidArgument: a given
// surface that is not closed.
Result<TriangleSurface> make_tumour_surface(const CaseInputs& inputs);

// A tumour that reaches the cortex sticks out a little where its segmentation and the brain's mask
// disagree, or where the mesh rounds off a gyrus.
inline constexpr double kLargestCut_mm = 3.0;

struct FittedTumour {
  TriangleSurface surface;  // every vertex in the mesh or on its surface
  std::string note;         // what was cut, for the user; empty when nothing was
};

// Cuts the tumour at the brain's surface: a vertex outside the mesh moves to the closest point of
// the mesh's surface. kInvalidArgument when a vertex lies farther out than kLargestCut_mm, with the
// number of vertices outside and the largest distance.
Result<FittedTumour> fit_tumour(TriangleSurface tumour, const TetMesh& mesh,
                                const CaseConfig& config);

// The key of the case file that gives the tumour: "tumour.ellipsoid", "tumour.label_volume", ...
const char* tumour_key(const CaseConfig& config);

}  // namespace brainshift::anatomy
