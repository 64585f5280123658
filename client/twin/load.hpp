// SPDX-License-Identifier: GPL-3.0-or-later
// The swelling of a simulated surgery, and the nodal forces it causes (fem/swelling.hpp).
#pragma once

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"

namespace brainshift::client {

// theta(r) = volume_strain (1 - (r / radius)^2)^2 for r < radius, else 0; r: distance to the
// centre. Largest in the middle, fading out without an edge.
struct Swelling {
  double volume_strain = 0.0;  // > 0 swells, < 0 shrinks, 0: none
  double radius_mm = 0.0;
  // Of the centre, beyond the tumour's centroid as seen from the craniotomy.
  double depth_mm = 0.0;
};

// Mean of the craniotomy's nodes, mm.
Vec3 craniotomy_centre(const BrainModel& model);
// Centre of the swelling in this patient, mm.
Vec3 swelling_centre(const BrainModel& model, const Swelling& swelling);

// theta(r), no unit.
double volume_strain_at(const Swelling& swelling, double distance_mm);

// Nodal forces, 3 x n, N.
Points swelling_load(const TetMesh& mesh, const Material& material, const Vec3& centre,
                     const Swelling& swelling);

}  // namespace brainshift::client
