// SPDX-License-Identifier: GPL-3.0-or-later
// Swelling of the simulated surgeries (fem/swelling.hpp).
#pragma once

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"

namespace brainshift::client {

// theta(r) = volume_strain (1 - (r / radius)^2)^2 within radius of the centre, 0 outside: densest in the
// middle, fading out without an edge.
struct Swelling {
  double volume_strain = 0.0;  // > 0 swells, < 0 shrinks, 0: none
  double radius_mm = 0.0;
  double depth_mm =
      0.0;  // of the centre: beyond the tumour's centroid, as seen from the craniotomy
};

// Mean of the craniotomy's nodes, mm.
Vec3 craniotomy_centre(const BrainModel& model);
// Centre of the swelling in this patient, mm.
Vec3 swelling_centre(const BrainModel& model, const Swelling& swelling);

double volume_strain_at(const Swelling& swelling, double distance_mm);

// Nodal forces, 3 x n, N.
Points swelling_load(const TetMesh& mesh, const Material& material, const Vec3& centre,
                     const Swelling& swelling);

}  // namespace brainshift::client
