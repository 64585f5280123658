// SPDX-License-Identifier: GPL-3.0-or-later
// The tetrahedral mesh of a case, generated from the brain mask or the ready one that the case
// names, and the surface of its tumour.
#pragma once

#include <string>

#include "common/anatomy/given_inputs.hpp"
#include "common/anatomy/regions.hpp"
#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"

namespace brainshift::anatomy {

// The undeformed tumour surface of a case: from an ellipsoid, a label volume or a surface file.
// Closed and oriented outwards. An ellipsoid or a label volume gives vertices about 1 mm apart
// (about 2,500 for the 10.99 cc tumour of the paper, which had 2,541), one closed surface for each
// focus. Errors and notes: as tumour_foci and closed_surface (given_inputs.hpp); kInvalidArgument:
// a surface of less than 2 or more than 200 mm.
Result<TriangleSurface> make_tumour_surface(const CaseInputs& inputs, Notes* notes = nullptr);

// A tumour that reaches the cortex sticks out a little where its segmentation and the brain's mask
// disagree, or where the mesh rounds off a gyrus.
inline constexpr double kLargestCut_mm = 3.0;

struct FittedTumour {
  TriangleSurface surface;  // every vertex in the mesh or on its surface
  std::string note;         // what was cut, for the user; empty when nothing was
};

// Cuts the tumour at the brain's surface: a vertex outside the mesh moves to the closest point of
// the mesh's surface. kInvalidArgument when a vertex lies farther out than kLargestCut_mm, with
// the number of vertices outside and the largest distance, and LPS or metres where those would
// fit.
Result<FittedTumour> fit_tumour(TriangleSurface tumour, const TetMesh& mesh,
                                const CaseConfig& config);

// The key of the case file that gives the tumour: "tumour.ellipsoid", "tumour.label_volume", ...
const char* tumour_key(const CaseConfig& config);

// Generated: brain_mask, without_sulci (given_inputs.hpp) -> Gaussian -> mesh, with the edges of
// mesh.generate.
// tumour_edge_mm applies near the tumour surface. From a refined zone to the rest the edge grows
// by a third of the distance.
// Ready: must pass geometry::check_mesh.
// Either way the largest side of the bounding box must lie between 20 and 400 mm; outside this
// range metres and millimetres were probably mixed up (kInvalidArgument). kEmptySet: mask without
// component. kDegenerateMesh.
// regions (optional), of a generated mesh: its tetrahedra lie in one of them each (mesh_regions).
Result<TetMesh> make_brain_mesh(const CaseInputs& inputs, const TriangleSurface& tumour,
                                const Progress& progress = {}, Notes* notes = nullptr,
                                const Regions* regions = nullptr);

}  // namespace brainshift::anatomy
