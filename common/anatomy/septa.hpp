// SPDX-License-Identifier: GPL-3.0-or-later
// Falx and tentorium as slits, ventricles as cavities: what a mesh of regions becomes.
//
//   slit     interface facets between left and right cerebrum (falx), or cerebrum and cerebellum
//            (tentorium), at whose three nodes and centre no tissue joins the sides
//            (Regions::parted) and that lie outside the tumour. A node of such facets is doubled
//            where they part its tetrahedra; at the slit's free edge they do not.
//   cavity   tetrahedra of the ventricles, which are taken out. Those that touch the outer surface
//            stay, as brain.
// Teeth (facets that hang on one edge) and islands of a slit, facets that would part small pieces
// of tissue from the brain, small parts of the ventricles, and tissue that stands in ventricles
// without touching the brain, go and are told.
#pragma once

#include <vector>

#include "common/anatomy/given_inputs.hpp"
#include "common/anatomy/regions.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/geometry/slit_mesh.hpp"

namespace brainshift::anatomy {

inline constexpr double kSmallestSeptum_mm2 = 400.0;     // of a part of a septum
inline constexpr double kSmallestVentricle_mm3 = 500.0;  // of a part of the ventricles
inline constexpr double kLargestLostTumour = 0.3;        // share of its volume
inline constexpr double kSmallestPiece_mm3 = 10000.0;    // of tissue apart from the brain

// The mesh of mesh_regions with slits and cavities as the case asks; labels become those of
// values/brain_model.hpp. tumour: closed, or it does not count. kEmptySet: none of what
// anatomy.septa asks for is there: no facet. kInvalidArgument: more than kLargestLostTumour of the
// tumour stands in ventricles. kDegenerateMesh: as check_mesh.
Result<geometry::SlitMesh> with_septa_and_ventricles(const TetMesh& mesh, const Regions& regions,
                                                     const AnatomyConfig& wanted,
                                                     const TriangleSurface& tumour,
                                                     const std::string& what, Notes* notes);

}  // namespace brainshift::anatomy
