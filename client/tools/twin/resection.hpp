// SPDX-License-Identifier: GPL-3.0-or-later
// A brain from which a part of the tumour has been taken.
//
//   removed   of the tetrahedra whose centre lies inside the tumour, those nearest to the
//             craniotomy, measured along the line from its centre to the tumour's centroid, until
//             they hold `volume_fraction` of the volume of all of them
//   stiffness of a removed tetrahedron: kCavityStiffness times the case's shear modulus, with
//             Poisson ratio 0, so that the cavity neither holds its wall nor keeps its volume
//   weight    none. A cavity is filled by what surrounds the brain at its depth, fluid below the
//             fluid plane and air above it, so the net weight (fem/body_loads.hpp) of its content
//             is 0 on either side of the plane: loads come from the tissue that is left. The
//             brain sags into the cavity.
// The way in is not modelled: the tissue between the cortex and the tumour stays whole.
//
// A node is *attached* when it belongs to a tetrahedron that is left. Inside the cavity the
// displacement is that of its soft filling, which is no tissue: it is neither measured nor scored.
//
// Ultrasound of a cavity filled with saline shows its wall, and beyond it the outline of the rest
// of the tumour. Both lie on the tumour's surface before surgery and are in one segmentation. The
// face of the cut is not on that surface; an observer who knows what was cut leaves it out. So
// what is measured of the tumour's boundary is the part of its surface at attached nodes.
#pragma once

#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

struct Resection {
  double volume_fraction = 0.7;  // of the tumour; above 0, at most 1
};
// A factor of a thousand below tissue: the walls move as if there were nothing between them, and
// the factorisation still keeps ten digits.
inline constexpr double kCavityStiffness = 1e-3;

struct ResectedBrain {
  BrainModel model;            // a label of its own for the cavity
  CaseConfig config;           // its material; a material of the tumour becomes one of a label
  TetMesh tissue;              // all nodes, the tetrahedra that are left
  std::vector<char> attached;  // per node
};

// kInvalidArgument: volume_fraction. kEmptySet: no tetrahedron has its centre in the tumour.
Result<ResectedBrain> resect(const BrainModel& model, const CaseConfig& config,
                             const Resection& resection);

}  // namespace brainshift::client
